"""The commands ``course`` and ``autograder``: what they look at before anything is imported."""
