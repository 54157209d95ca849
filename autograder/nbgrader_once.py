"""What the ``nbgrader_config.py`` of earlier courses imports from here."""

from autograder.gradebook.once import FeedbackExporter as FeedbackExporter
