"""What the ``nbgrader_config.py`` of earlier courses imports from here."""

from autograder.gradebook.nbgrader_plugins.autograde_steps import FlagForHumans as FlagForHumans
from autograder.gradebook.nbgrader_plugins.autograde_steps import (
    GradeByBehaviour as GradeByBehaviour,
)
from autograder.gradebook.nbgrader_plugins.autograde_steps import RestoreCells as RestoreCells
from autograder.gradebook.nbgrader_plugins.autograde_steps import (
    SubmissionExporter as SubmissionExporter,
)
