# title: A display of 100 MB, and an error of 100 MB
# told: Code cell 3 of the notebook raised ValueError

from IPython.display import HTML, display

display(HTML("x" * 100_000_000))
raise ValueError("x" * 100_000_000)
