"""Due dates, extensions and penalties: what is taken off is what the gradebook says now."""

from __future__ import annotations

import csv
import json
import unicodedata
from datetime import datetime, timedelta
from pathlib import Path

import pytest
from nbgrader.api import Gradebook
from traitlets.config import Config

from autograder.class_report.platforms import grades_csv
from autograder.gradebook import extensions, penalties
from autograder.gradebook.course_gradebook import CourseGradebook, Grade, GradebookError
from autograder.gradebook.database import GradebookUnusable
from autograder.gradebook.extensions import ExtensionError
from autograder.grading import engine, grades_table
from autograder.grading.engine import AssignmentError
from tests.autograder.commands.test_cli import autograder
from tests.autograder.conftest import ASSIGNMENT, NOTEBOOK, Course, Undisturbed
from tests.autograder.grading.test_resume import Seen
from tests.killing import fresh_copy
from tests.machine import needs_sandbox

pytestmark = [needs_sandbox, pytest.mark.xdist_group("class"), pytest.mark.timeout(900)]

HANDED_IN = datetime(2030, 1, 31, 12)
PLUGIN = """
from nbgrader.plugins import LateSubmissionPlugin


class ShareAnHour(LateSubmissionPlugin):
    def late_submission_penalty(self, student_id, score, total_seconds_late):
        return 0.1 * score * total_seconds_late / 3600
"""
USED = "\nc.AssignLatePenalties.plugin_class = ShareAnHour\n"


@pytest.fixture
def course(class_: Undisturbed, tmp_path: Path) -> Course:
    """A graded class in which what 'right' and 'same' handed in has a date."""
    course = Course(fresh_copy(class_.graded, tmp_path / "course"))
    for student in ("right", "same"):
        (course.folder(student) / "timestamp.txt").write_text(f"{HANDED_IN} UTC")
    return course


def book(course: Course) -> Gradebook:
    return Gradebook(f"sqlite:///{course.root / 'gradebook.db'}")


def configure(course: Course, text: str) -> None:
    with (course.root / "nbgrader_config.py").open("a") as config:
        config.write(text)


def due(course: Course, hours: float) -> None:
    """Set the due date to some hours before the work was handed in."""
    with book(course) as gradebook:
        gradebook.update_or_create_assignment(
            ASSIGNMENT, duedate=HANDED_IN - timedelta(hours=hours)
        )


def again(course: Course, *students: str) -> tuple[Seen, dict[str, Grade]]:
    seen = Seen()
    engine.grade(course.root, ASSIGNMENT, students=students, feedback=False, progress=seen)
    return seen, {g.student: g for g in CourseGradebook(course.root).read_grades(ASSIGNMENT)}


def test_what_is_taken_off_follows_dates_extensions_marks_and_rules(course: Course) -> None:
    configure(course, PLUGIN + USED)
    _, found = again(course)
    full = found["right"].score
    assert (found["right"].seconds_late, found["right"].penalty) == (0, 0)

    due(course, 2)
    seen, found = again(course)
    assert (seen.run, seen.unchanged) == (0, 0), "the due date is everybody's"
    assert found["right"].seconds_late == found["same"].seconds_late == 7200
    assert found["right"].penalty == pytest.approx(0.2 * full)
    assert found["right"].score == pytest.approx(0.8 * full)
    seen, _ = again(course)
    assert (seen.unchanged, seen.entered) == (4, [])

    [granted] = extensions.grant_extensions(course.root, ASSIGNMENT, ["right"], 1)
    assert (granted.time, granted.waits) == (HANDED_IN - timedelta(hours=1), False)
    seen, found = again(course)
    assert (seen.run, seen.entered) == (0, ["right"])
    assert found["right"].penalty == pytest.approx(0.1 * full)

    with book(course) as gradebook:
        cell = gradebook.find_grade("qos-explanation-depth", NOTEBOOK, ASSIGNMENT, "right")
        cell.manual_score, cell.needs_manual_grade = 1.0, False
        gradebook.db.commit()
    seen, found = again(course)
    assert (seen.run, seen.entered) == (0, ["right"]), "a share of the marks is taken off, too"
    assert found["right"].penalty == pytest.approx(0.1 * (full + 1))
    assert found["right"].cells[NOTEBOOK]["qos-explanation-depth"] == 1.0

    configure(course, "\nc.AssignLatePenalties.plugin_class = LateSubmissionPlugin\n")
    configure(course, "\nc.LateSubmissionPlugin.penalty_method = 'zero'\n")
    _, found = again(course)
    assert (found["right"].score, found["same"].score) == (0, 0)
    extensions.grant_extensions(course.root, ASSIGNMENT, ["right", "same"], 2)
    _, found = again(course)
    assert (found["right"].score, found["same"].score) == (full + 1, full)


def test_a_plugin_of_the_courses_own_counts_with_its_file(course: Course) -> None:
    plugin = course.root / "our_late_rule.py"
    plugin.write_text(PLUGIN)
    configure(course, "\nfrom our_late_rule import ShareAnHour" + USED)
    due(course, 1)
    only = ("--student", "right", "--root", str(course.root))

    def run(*arguments: str) -> str:
        return autograder(*arguments, cwd=course.root.parent, timeout=600).stdout

    cli = json.loads(run("grade", "ch05", *only, "--json"))
    assert [grade["student"] for grade in cli["grades"]] == ["right"]
    assert cli["grades"][0]["penalty"] == pytest.approx(1.5)
    plugin.write_text(PLUGIN.replace("0.1", "0.2"))
    table = run("grade", "ch05", *only)
    assert "1 h 00 min" in table
    assert "-3" in table
    assert "12 of 20" in table
    assert "same" not in table
    assert "-3" in run("report", "ch05", *only[2:])
    rows = list(csv.DictReader((course.root / "grades.csv").read_text().splitlines()))
    late = {row["student_id"]: row["late_submission_penalty"] for row in rows}
    assert (late["right"], len(late)) == ("3.0", 4)


def test_an_extension_may_come_before_the_work(course: Course, class_: Undisturbed) -> None:
    configure(course, "\nc.LateSubmissionPlugin.penalty_method = 'zero'\n")
    due(course, 2)
    with book(course) as gradebook:
        gradebook.add_student("early")
    said = autograder(
        "extend", ASSIGNMENT, "early", "right", "--hours", "2.5", cwd=course.root
    ).stdout
    assert "early: due 2030-01-31 12:30 UTC; it counts once the work is graded." in said
    assert "right: due 2030-01-31 12:30 UTC; run `autograder grade ch05`" in said
    assert not [
        g for g in CourseGradebook(course.root).read_grades(ASSIGNMENT) if g.student == "early"
    ]
    course.submit("early", (course.folder("right") / f"{NOTEBOOK}.ipynb").read_text())
    (course.folder("early") / "timestamp.txt").write_text(f"{HANDED_IN} UTC")
    _, found = again(course)
    assert found["early"].score == found["right"].score == class_.grades["right"].score
    assert found["same"].score == 0
    with book(course) as gradebook:
        submission = gradebook.find_submission(ASSIGNMENT, "early")
        assert submission.extension == timedelta(hours=2.5)
    extensions.grant_extensions(course.root, ASSIGNMENT, ["early"], 0)
    _, found = again(course)
    assert found["early"].score == 0, "an extension that is taken away stays away"


@pytest.mark.parametrize(("typed", "written"), [("NFC", "NFD"), ("NFD", "NFC"), ("NFD", "NFD")])
def test_a_name_is_the_same_student_in_either_form_of_unicode(
    course: Course, class_: Undisturbed, typed: str, written: str
) -> None:
    typed, written, name = (unicodedata.normalize(f, "Müller") for f in (typed, written, "NFC"))
    configure(course, "\nc.LateSubmissionPlugin.penalty_method = 'zero'\n")
    due(course, 2)
    course.submit(written, (course.folder("right") / f"{NOTEBOOK}.ipynb").read_text())
    (course.folder(written) / "timestamp.txt").write_text(f"{HANDED_IN} UTC")
    [granted] = extensions.grant_extensions(course.root, ASSIGNMENT, [typed], 2.5)
    assert (granted.student, granted.waits) == (name, True)
    seen, found = again(course, typed)
    assert seen.entered == [name]
    assert found[name].score == class_.grades["right"].score, "it has its extension"
    [granted] = extensions.grant_extensions(course.root, ASSIGNMENT, [typed], 0)
    assert (granted.student, granted.waits) == (name, False)
    only = ("--student", typed, "--root", str(course.root), "--json")
    said = autograder("grade", ASSIGNMENT, *only, cwd=course.root.parent, timeout=600).stdout
    assert [(g["student"], g["score"]) for g in json.loads(said)["grades"]] == [(name, 0)]


def test_an_extension_that_makes_no_sense_is_one_sentence(course: Course) -> None:
    with pytest.raises(ExtensionError, match=r"never due.*--duedate"):
        extensions.grant_extensions(course.root, ASSIGNMENT, ["right"], 1)
    due(course, 1)
    with pytest.raises(ExtensionError, match=r"no student 'rihgt' \(is it 'right'\?\)"):
        extensions.grant_extensions(course.root, ASSIGNMENT, ["same", "rihgt"], 1)
    with book(course) as gradebook:
        assert gradebook.find_submission(ASSIGNMENT, "same").extension is None
    with pytest.raises(ExtensionError, match=r"no assignment 'ch5'.*there are ch05"):
        extensions.grant_extensions(course.root, "ch5", ["right"], 1)
    for hours in (-1, float("nan"), float("inf"), 1e9):
        with pytest.raises(ExtensionError, match="0 to 87840 hours"):
            extensions.grant_extensions(course.root, ASSIGNMENT, ["right"], hours)


def test_only_the_named_students_are_graded(course: Course) -> None:
    seen, _ = again(course, "same")
    assert (seen.unchanged, seen.entered) == (0, ["same"])
    seen = Seen()
    engine.grade(course.root, ASSIGNMENT, students=["cut-off"], fresh=True, progress=seen)
    assert (seen.run, seen.entered) == (0, ["cut-off"])
    seen, _ = again(course)
    assert (seen.unchanged, seen.entered) == (3, ["right"]), "nobody else is to be run anew"
    with pytest.raises(AssignmentError, match=r"'rigth' has not submitted.*is it 'right'\?"):
        again(course, "rigth")


def test_a_rule_that_cannot_be_loaded_is_one_sentence(course: Course) -> None:
    configure(course, "\nc.AssignLatePenalties.plugin_class = 'no_such_module.Rule'\n")
    with pytest.raises(GradebookUnusable, match=r"nbgrader_config\.py names cannot be loaded"):
        again(course)
    configure(course, "\nfrom no_such_module import Rule\n")
    with pytest.raises(GradebookError, match=r"cannot be used \(ModuleNotFoundError"):
        again(course)


def test_a_rule_is_its_class_its_code_and_its_settings() -> None:
    found = []
    for settings in (
        {},
        {"AssignLatePenalties": {"plugin_class": "nbgrader.plugins.LateSubmissionPlugin"}},
        {"LateSubmissionPlugin": {"penalty_method": "zero"}},
        {"LateSubmissionPlugin": {"penalty_method": "none"}},
    ):
        found.append(penalties.rule_digest(Config(settings)))
        assert penalties.rule_digest(Config(settings)) == found[-1]
    assert len(set(found)) == len(found)


@pytest.mark.parametrize(
    ("seconds", "words"),
    [
        (0, ""), (1, "1 min"), (90, "2 min"), (3599, "1 h 00 min"), (7500, "2 h 05 min"),
        (86400, "1 d 0 h"), (200_000, "2 d 7 h"),
    ],
)  # fmt: skip
def test_lateness_is_told_as_people_tell_it(seconds: float, words: str) -> None:
    assert penalties.lateness_text(seconds) == words


def test_columns_of_lateness_come_last_and_only_when_somebody_was_late(tmp_path: Path) -> None:
    in_time = Grade("ada", 3.0, 5.0, False, {"nb": {"a": 3.0}})
    late = Grade("bob", 2.0, 5.0, False, {"nb": {"a": 3.0}}, seconds_late=3600, penalty=1)
    assert len(grades_table.make_table([in_time], {"eve": "why"}).columns) == 4
    assert len(grades_table.make_table([in_time, late], {"eve": "[why"}).columns) == 6
    grades_csv.write_grades({"ch05": [in_time, late]}, tmp_path / "grades.csv")
    rows = list(csv.reader((tmp_path / "grades.csv").read_text().splitlines()))
    assert [row[-3:] for row in rows[1:]] == [["3.0", "0.0", "0.0"], ["3.0", "3600", "1"]]
