"""The table of an assignment's grades, as `autograder grade` and `report` print it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from rich.table import Table

from autograder.assignments.intake.handed_files.file_names import printable_name
from autograder.gradebook.course_gradebook import Grade
from autograder.gradebook.penalties import lateness_text


def make_table(grades: Iterable[Grade], problems: Mapping[str, str]) -> Table:
    """Return a row a student; how late, and what that costs, if somebody was late.

    Args:
        grades: the grades.
        problems: {student: what a person should know}, of students without a grade, too.
    """
    grades = list(grades)
    late = any(grade.seconds_late or grade.penalty for grade in grades)
    more = ("Late", "Penalty") if late else ()
    made = Table("Student", "Score", *more, "Needs a person", "Remark")
    for grade in grades:
        score = "?" if grade.asked else f"{grade.score:g}"
        cells = [printable_name(grade.student), f"{score} of {grade.max_score:g}"]
        if late:
            cells += [
                lateness_text(grade.seconds_late),
                f"-{grade.penalty:g}" if grade.penalty else "",
            ]
        needs = "yes" if grade.needs_manual_grade else ""
        remark = problems.get(grade.student, "") or " ".join(grade.asked.values())
        made.add_row(*cells, needs, remark)
    for student in sorted(problems.keys() - {grade.student for grade in grades}):
        empty = ["" for _ in more]
        made.add_row(printable_name(student), "none", *empty, "yes", problems[student])
    return made
