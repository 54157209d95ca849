"""What a course's ``nbgrader_config.py`` imports: these names stay, wherever their modules go."""

from __future__ import annotations

from autograder.gradebook.feedback.index_page import IndexPages as IndexPages
from autograder.gradebook.nbgrader_plugins.autograde_steps import FlagForHumans as FlagForHumans
from autograder.gradebook.nbgrader_plugins.autograde_steps import (
    GradeByBehaviour as GradeByBehaviour,
)
from autograder.gradebook.nbgrader_plugins.autograde_steps import RestoreCells as RestoreCells
from autograder.gradebook.nbgrader_plugins.autograde_steps import (
    SubmissionExporter as SubmissionExporter,
)
from autograder.gradebook.nbgrader_plugins.model_answers import ShowModelAnswers as ShowModelAnswers
from autograder.gradebook.nbgrader_plugins.nbgrader_speedups import (
    FeedbackExporter as FeedbackExporter,
)
from autograder.gradebook.nbgrader_plugins.settled_export import SettledExport as SettledExport
