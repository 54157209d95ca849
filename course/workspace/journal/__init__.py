"""What a student has done in a working copy: kept in a small file there, and shown as a page.

Nothing of it leaves the machine, and no grade comes from it. `journal_file` is the file, `notes`
writes into it which cells ran, `student_notebooks` reads the student's notebooks, `progress` puts
all together, `progress_page` shows it as Markdown and as text, `welcome` in the notebook that
`course lab` opens first.
"""
