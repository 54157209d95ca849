"""What the ``nbgrader_config.py`` of earlier courses imports from here."""

from autograder.gradebook.settled_export import SettledExport as SettledExport
