"""The Markdown and the LaTeX of a bank as HTML that needs nothing else."""
