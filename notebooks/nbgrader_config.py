"""nbgrader's configuration for this course: this folder is the course root."""

from pathlib import Path

from nbconvert.preprocessors import ClearMetadataPreprocessor
from nbgrader.preprocessors import (
    AssignLatePenalties,
    CheckCellMetadata,
    ClearOutput,
    DeduplicateIds,
    IgnorePattern,
    LimitOutput,
    OverwriteCells,
    OverwriteKernelspec,
    SaveAutoGrades,
)

from autograder.nbgrader_bridge import (
    FeedbackExporter,
    FlagForHumans,
    GradeByBehaviour,
    IndexPages,
    RestoreCells,
    SettledExport,
    ShowModelAnswers,
    SubmissionExporter,
)

c = get_config()  # noqa: F821 - given by nbgrader
root = Path(__file__).resolve().parent

c.CourseDirectory.course_id = "ros2-course"
c.CourseDirectory.root = str(root)
c.NbGrader.logfile = str(root / ".nbgrader.log")

# What stands in place of a solution. The code stub raises nothing: what is given around it runs,
# so that a student can check early and see what is still missing.
c.ClearSolutions.code_stub = {"python": "# Your work goes here."}
c.ClearSolutions.text_stub = "*Your answer goes here.*"

# A deleted test cell would otherwise say "needs manual grading" for ever.
c.OverwriteCells.add_missing_cells = True

# `nbgrader validate` runs the checks in a kernel: some need several seconds of simulated time.
c.Execute.timeout = 300

# Submissions run in a sandbox (bubblewrap), and are not graded without one. Set this to True only
# if you trust every one of them: they then run with your own rights.
c.GradeByBehaviour.trust_submissions = False

# Our own steps among nbgrader's: first read what may be no notebook at all and mend what a student
# did to the instructor's cells, then watch the nodes instead of trusting what the notebook prints,
# and flag what a person must see.
c.Autograde.exporter_class = SubmissionExporter
c.Autograde.sanitize_preprocessors = [
    RestoreCells,
    ClearOutput,
    DeduplicateIds,
    OverwriteKernelspec,
    OverwriteCells,
    CheckCellMetadata,
]
c.Autograde.autograde_preprocessors = [
    GradeByBehaviour,
    IgnorePattern,
    ClearMetadataPreprocessor,
    LimitOutput,
    SaveAutoGrades,
    FlagForHumans,
    AssignLatePenalties,
    CheckCellMetadata,
]

# Feedback that holds the pictures it shows (the exchange hands out the page alone), calls answers
# by their questions and says what waits for its mark; and a page about all exercises beside it.
c.GenerateFeedback.exporter_class = FeedbackExporter
c.GenerateFeedback.post_convert_hook = IndexPages(c)

# The formgrader shows the model answer above each written answer; no other page has it.
c.HTMLExporter.preprocessors = [ShowModelAnswers]

# `nbgrader export` leaves out whom a person is to be asked about: that is no score to pass on.
c.ExportApp.plugin_class = SettledExport
