"""What the ``nbgrader_config.py`` of earlier courses imports from here."""

from autograder.gradebook.model_answers import ShowModelAnswers as ShowModelAnswers
