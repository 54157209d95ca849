"""A JupyterHub for a class: its configuration, as `autograder new hub` writes it."""
