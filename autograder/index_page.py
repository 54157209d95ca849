"""What the ``nbgrader_config.py`` of earlier courses imports from here."""

from autograder.gradebook.feedback.index_page import IndexPages as IndexPages
