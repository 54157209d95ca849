"""What the ``nbgrader_config.py`` of earlier courses imports from here."""

from autograder.gradebook.bridge import FlagForHumans as FlagForHumans
from autograder.gradebook.bridge import GradeByBehaviour as GradeByBehaviour
from autograder.gradebook.bridge import RestoreCells as RestoreCells
from autograder.gradebook.bridge import SubmissionExporter as SubmissionExporter
