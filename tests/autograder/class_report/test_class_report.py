"""The class report: right figures, safe exports, honest hints, from really graded submissions."""

from __future__ import annotations

import csv
import io
import itertools
import json
import random
import re
import tomllib
from collections.abc import Sequence
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import nbformat
import numpy as np
import pytest

from autograder import exercises
from autograder.assignments import questions, submission
from autograder.assignments.questions import GradedQuestion
from autograder.class_report import ClassReportError, attention, feedback, figures, means
from autograder.class_report import report_files as reports
from autograder.class_report import report_page as pages
from autograder.class_report.class_data import ClassData, Person, collect_class
from autograder.class_report.platforms import exports
from autograder.class_report.similarity import alike_pairs, compared_work
from autograder.class_report.similarity.own_text import GivenText, OwnText, own_tokens
from autograder.examination import points
from autograder.examination.verdict import CheckResult, Status, Verdict
from autograder.gradebook import verdict_records
from autograder.gradebook.course_gradebook import Grade
from autograder.gradebook.database import GradebookUnusable
from autograder.gradebook.verdict_records import Record
from autograder.util import csv_text, exercise_folders
from autograder.util.state_table import StateTable
from tests.autograder.commands.test_cli import autograder
from tests.autograder.conftest import ASSIGNMENT, NOTEBOOK, Course

pytestmark = pytest.mark.xdist_group("graded class")

EVIL = "<script>alert(1)</script>"
NOTHING_GIVEN = GivenText({})


class Links(HTMLParser):
    """Collects what a browser would load or run, and whether the tags are balanced."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.loads: list[str] = []
        self.open: list[str] = []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag in ("script", "link", "img", "iframe", "object", "embed", "base", "form"):
            self.loads.append(tag)
        for name, value in attrs:
            local = (value or "").startswith("#")
            if name.startswith("on") or (name in ("src", "href", "xlink:href") and not local):
                self.loads.append(f"{tag} {name}={value}")
        if tag not in ("meta", "br"):
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.handle_starttag(tag, attrs)
        self.handle_endtag(tag)

    def handle_endtag(self, tag: str) -> None:
        if tag != "meta":
            assert self.open.pop() == tag


def result(name: str, status: Status, points: float = 1.0, actual: str = "") -> CheckResult:
    earned = points if status == "passed" else 0.0
    return CheckResult(name, f"Title of {name}.", status, earned, points, actual=actual)


def grade(student: str, score: float = 1.0, waits: bool = False) -> Grade:
    cells = {NOTEBOOK: {"qos-visible": score, "qos-explanation-depth": None if waits else 0.0}}
    return Grade(student, score, 20.0, waits, cells)


def class_of(verdicts: dict[str, Sequence[CheckResult]], seconds: float = 2.0) -> ClassData:
    kept = {
        student: {NOTEBOOK: Record({"qos-visible": Verdict("qos", "visible", tuple(found))},
                                   seconds=seconds)}
        for student, found in verdicts.items()
    }  # fmt: skip
    return ClassData(
        Path("/nowhere"), ASSIGNMENT, 20.0, tuple(grade(student) for student in sorted(kept)),
        records=kept,
    )  # fmt: skip


def class_of_skill(count: int, worth: Sequence[float], seed: int = 1) -> ClassData:
    """Students who pass each check with a probability of their own."""
    rng = random.Random(seed)
    return class_of({
        f"s{n:03}": [
            result(f"c{k}", "passed" if rng.random() < n / count else "failed", points)
            for k, points in enumerate(worth)
        ]
        for n in range(count)
    })  # fmt: skip


def rows_of(text: str) -> list[list[str]]:
    return list(csv.reader(io.StringIO(text)))


# Figures


def test_failure_rates_and_discrimination_are_what_numpy_says() -> None:
    worth = [1.0, 2.0, 0.5, 3.0, 0.1]
    data = class_of_skill(90, worth)
    passed = np.array([
        [check.passed for check in notebooks[NOTEBOOK].verdicts["qos-visible"].checks]
        for notebooks in data.records.values()
    ])  # fmt: skip
    earned = passed * np.array(worth)
    found = figures.check_figures(data)
    assert [check.name for check in found] == ["c0", "c1", "c2", "c3", "c4"]
    for k, check in enumerate(found):
        rest = earned.sum(axis=1) - earned[:, k]
        assert check.passed == passed[:, k].sum()
        assert check.failure_rate == pytest.approx(1 - passed[:, k].mean())
        assert check.discrimination == pytest.approx(np.corrcoef(passed[:, k], rest)[0, 1])
        assert check.discrimination is not None
        assert check.discrimination > 0.3


def test_nothing_is_advised_on_fewer_than_five_failures() -> None:
    def advice(students: int, failing: int) -> str:
        data = class_of({
            f"s{n:03}": [result("x", "failed" if n < failing else "passed"),
                         result("y", "passed" if n % 2 else "failed")]
            for n in range(students)
        })  # fmt: skip
        return figures.check_figures(data)[0].advice

    assert advice(9, 8) == "too few submissions"
    assert [advice(students, 4) for students in (10, 12, 400)] == ["", "", ""]
    assert "does not tell" in advice(12, 6)
    assert "most fail it" in advice(12, 11)
    assert advice(400, 5) == "hardly anybody fails it"


def test_what_was_not_handed_in_is_apart_from_what_was_not_checked() -> None:
    data = class_of({
        "a": [result("x", "passed"), result("y", "not_checked")],
        "b": [result("x", "not_checked"), result("y", "not_checked")],
        "c": [result("x", "failed"), result("y", "not_checked")],
    })  # fmt: skip
    data = replace(data, left_out={"b": frozenset({NOTEBOOK})}, absent=("zoe",))
    x, y = figures.check_figures(data)
    assert (x.passed, x.failed, x.not_checked, x.not_handed_in, x.examined_count) == (1, 1, 0, 2, 2)
    assert (y.not_checked, y.not_handed_in, y.examined_count) == (2, 2, 0)
    assert "b" not in figures.run_times(data).seconds


# Means


def question(grade_id: str, title: str, most: float, written: bool = False) -> GradedQuestion:
    return GradedQuestion(NOTEBOOK, grade_id, title, written, most)


def test_means_are_of_what_was_handed_in_and_marked_each_with_its_n() -> None:
    cells = {
        "ann": {"qos-visible": 8.0, "qos-explanation-depth": 1.0},
        "bob": {"qos-visible": 4.0, "qos-explanation-depth": None},
        "cy": {"qos-visible": 0.0, "qos-explanation-depth": 0.0},
    }
    data = class_of({
        "ann": [result("camera_newest", "passed", 2.0), result("late_joiner", "failed", 3.0)],
        "bob": [result("camera_newest", "failed", 2.0), result("late_joiner", "grader_error")],
        "cy": [result("camera_newest", "not_checked", 2.0)],
    })  # fmt: skip
    data = replace(
        data, left_out={"cy": frozenset({NOTEBOOK})},
        grades=tuple(Grade(who, 0.0, 11.0, False, {NOTEBOOK: c}) for who, c in cells.items()),
        questions={NOTEBOOK: {
            "qos-visible": question("qos-visible", "Checks in the notebook", 10.0),
            "qos-explanation-depth": question("qos-explanation-depth", "Depth", 1.0, written=True),
        }},
    )  # fmt: skip
    found = means.of_class(data)
    [exercise] = found.exercises
    assert (exercise.n, exercise.mean, exercise.max_points, exercise.waiting) == (1, 9.0, 11.0, 1)
    visible, depth = found.questions
    assert (visible.title, visible.n, visible.mean, visible.share) == (
        "Checks in the notebook", 2, 6.0, 0.6,
    )  # fmt: skip
    assert (depth.title, depth.n, depth.mean, depth.waiting) == ("Depth", 1, 1.0, 1)
    objectives = {mean.title: mean for mean in found.objectives}
    history = objectives["Choose history and depth for a reader that can be slow"]
    assert (history.n, history.mean, history.waiting) == (2, (3 / 3 + 0 / 2) / 2, 1)
    durability = objectives["Choose durability for a reader that joins late"]
    assert (durability.n, durability.mean, durability.waiting) == (1, 0.0, 1)


def test_every_check_and_every_written_answer_of_the_course_has_one_objective() -> None:
    asked = {
        (exam, name)
        for exam, entry in points.table().items()
        for name in [*itertools.chain(*entry.parts.values()), *entry.manual]
    }
    assert set(means.load_objectives()) == asked
    for exam in exercises.exercise_names():
        lists = tomllib.loads(
            exercise_folders.exercise_file(exam, "objectives.toml").read_text("utf-8")
        )
        named = [name for names in lists.values() for name in names]
        assert len(named) == len(set(named)), exam


def test_what_was_not_examined_is_no_failure() -> None:
    data = class_of({
        "a": [result("x", "passed"), result("y", "passed")],
        "b": [result("x", "failed"), result("y", "not_checked")],
        "c": [result("x", "passed"), result("y", "grader_error")],
        "d": [result("x", "passed"), result("y", "failed")],
    })  # fmt: skip
    x, y = figures.check_figures(data)
    assert (x.passed, x.failed, x.failure_rate) == (3, 1, 0.25)
    assert (y.passed, y.failed, y.not_checked, y.grader_errors) == (1, 1, 1, 1)
    assert y.failure_rate == 0.5
    assert y.discrimination is None, "two submissions say nothing"
    assert "the grader itself failed" in y.advice


def test_every_figure_says_of_how_many_it_is() -> None:
    data = class_of({
        "ada": [result("x", "passed"), result("y", "not_checked")],
        "bob": [result("x", "failed"), result("y", "passed")],
        "cy": [result("x", "passed"), result("y", "grader_error")],
    })  # fmt: skip
    nothing: dict[str, dict[str, OwnText]] = {}
    report = reports.ClassReport(
        data, figures.check_figures(data), figures.run_times(data), [], [],
        compared_work.compare_class(data, nothing, NOTHING_GIVEN, 0.9), nothing, NOTHING_GIVEN,
        0.9, (),
        means.Means((), (), ()),
    )  # fmt: skip
    scores, checks, times = re.findall(r"<svg.*?</svg>", pages.render_page(report), re.DOTALL)
    assert ">points (n = 3)</text>" in scores
    assert ">seconds that a submission took (n = 3)</text>" in times
    rows = re.findall(r">n = (\d)</text>", checks)
    assert rows == ["3", "3", "3", "1"], "submissions by check, then those that it was examined on"


@pytest.mark.parametrize(
    ("asked", "called"),
    [({"qos-visible": "Checks in the notebook"}, "Checks in the notebook"), ({}, "qos-visible")],
)
def test_a_flagged_cell_is_called_by_its_question(asked: dict[str, str], called: str) -> None:
    data = class_of({"ada": [result("a", "passed")]})
    cells = {NOTEBOOK: {"qos-visible": None}}
    flagged = replace(data.grades[0], needs_manual_grade=True, cells=cells)
    known = {NOTEBOOK: {cell: question(cell, title, 1.0) for cell, title in asked.items()}}
    (need,) = attention.people_needed(replace(data, grades=(flagged,), questions=known))
    assert need.why == (
        f"“{called}” of Exercise 1: QoS profile design was flagged for a manual grade."
    )


def test_a_check_that_good_students_fail_is_pointed_out() -> None:
    data = class_of({
        f"s{n}": [
            *(result(f"c{k}", "passed" if n > k else "failed") for k in range(12)),
            result("odd", "failed" if n > 6 else "passed"),
        ]
        for n in range(13)
    })  # fmt: skip
    odd = figures.check_figures(data)[-1]
    assert odd.discrimination is not None
    assert odd.discrimination < -0.5
    assert "wording" in odd.advice


@pytest.mark.parametrize(
    "pairs", [[], [(1, 2), (0, 1)], [(1, 1), (1, 2), (1, 3)], [(0, 5), (1, 5), (1, 5)]]
)
def test_a_correlation_that_is_not_defined_is_none(pairs: list[tuple[float, float]]) -> None:
    assert figures.compute_discrimination(pairs) is None


def test_questions_of_a_quiz_and_unreadable_submissions_are_no_checks() -> None:
    data = class_of({"a": [result("x", "passed")]})
    quiz = Record({"quiz-ch05": Verdict("quiz-ch05", "answers", (result("q", "failed"),))})
    blank = Record(
        {"qos-visible": Verdict("qos", "visible", (result("x", "not_checked"),))}, unreadable=True
    )
    kept = {**data.records, "b": {NOTEBOOK: quiz}, "c": {NOTEBOOK: blank}}
    both = ClassData(data.root, ASSIGNMENT, 20.0, data.grades, records=kept)
    [x] = figures.check_figures(both)
    assert (x.name, x.passed, x.not_checked) == ("x", 1, 0)
    assert set(figures.run_times(both).seconds) == {"a", "b"}


# Feedback


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("Of 20 readings 3 arrived: 1, 2, 19.", "Of 7 readings 5 arrived: 0, 1, 2, 3 and 6."),
        ("NameError: name 'cam' is not defined", "NameError: name 'lidar_2' is not defined"),
        ("Nothing on /ann/scan after 1.5 s.", "Nothing on /bob/laser/scan after 12 s."),
        ("ann's node stopped", "bob's node stopped"),
        ("<Node object at 0x7f1c>", "<Node object at 0x99ab>"),
    ],
)
def test_feedback_is_grouped_without_numbers_and_names(one: str, other: str) -> None:
    assert feedback.strip_details(one, ["ann"]) == feedback.strip_details(other, ["bob"])


def test_different_feedback_stays_different_and_short() -> None:
    assert feedback.strip_details("It isn't there, it can't be") == "It isn't there, it can't be"
    assert feedback.strip_details("too few") != feedback.strip_details("too many")
    assert len(feedback.strip_details("x" * 10_000)) <= feedback.MAX_CHARS
    data = class_of({
        "a": [result("x", "failed", actual="Got 3.")],
        "b": [result("x", "failed", actual="Got 17.")],
        "c": [result("x", "failed", actual="Nothing came.")],
        "d": [result("x", "passed", actual="Got 3.")],
    })  # fmt: skip
    first, second = feedback.common_groups(data)
    assert (first.text, first.students) == ("Got #.", ("a", "b"))
    assert second.students == ("c",)


# Exports


def test_canvas_and_moodle_files_have_the_columns_that_they_import() -> None:
    people = {"ann": Person("ann", "Ann", "O'Hara, Jr.", "ann@example.org", "4711")}
    data = ClassData(Path("/x"), "ch05", 20.0, (grade("ann", 12.25), grade("bob", 7)), people)
    canvas = rows_of(exports.export_canvas(data, "Exercise 1 (99)").text)
    assert canvas == [
        ["Student", "ID", "SIS User ID", "SIS Login ID", "Section", "Exercise 1 (99)"],
        ["    Points Possible", "", "", "", "", "20"],
        ["O'Hara, Jr., Ann", "4711", "", "ann", "", "12.25"],
        ["bob", "", "", "bob", "", "7"],
    ]
    moodle = rows_of(exports.export_moodle(data).text)
    assert moodle == [
        ["Username", "ID number", "First name", "Last name", "Email address", "ch05"],
        ["ann", "4711", "Ann", "O'Hara, Jr.", "ann@example.org", "12.25"],
        ["bob", "", "", "", "", "7"],
    ]


def test_everybody_is_exported_and_only_a_final_grade_is_a_number() -> None:
    people = {name: Person(name) for name in ("ann", "bob", "zoe")}
    data = ClassData(
        Path("/x"), "ch05", 20.0, (grade("ann"), grade("bob", waits=True)), people,
        not_entered=("stranger",), absent=("zoe",),
    )  # fmt: skip

    def cells(export: exports.Export) -> dict[str, str]:
        # The login is the fourth column for Canvas, the first for Moodle.
        rows = [row for row in rows_of(export.text)[1:] if row[0] != exports.POINTS_POSSIBLE]
        return {(row[0] or row[3]): row[-1] for row in rows}

    for write in (exports.export_canvas, exports.export_moodle):
        export = write(data)
        assert cells(export) == {"ann": "1", "bob": "", "zoe": ""}
        assert (export.students, export.waiting, export.absent) == (1, ("bob",), ("zoe",))
        assert cells(write(data, provisional=True)) == {"ann": "1", "bob": "1", "zoe": ""}
        assert cells(write(data, zero_absent=True)) == {"ann": "1", "bob": "", "zoe": "0"}


@pytest.mark.parametrize(
    "student",
    ["=1+1", "+49", "-x", "@SUM(A1)", "\tx", "\rx", "\nx", " =1", "＝1", '=HYPERLINK("a","b")'],  # noqa: RUF001
)
def test_no_cell_of_an_export_is_a_formula(student: str) -> None:
    people = {student: Person(student, student, student, student, student)}
    data = ClassData(Path("/x"), "=ch05", 20.0, (grade(student),), people)
    for write in (exports.export_canvas, exports.export_moodle):
        export = write(data)
        assert export.guarded == (student,)
        for cell in (cell for row in rows_of(export.text) for cell in row):
            assert not cell.lstrip().startswith(csv_text.FORMULA), cell
        assert f"'{student}" in [cell for row in rows_of(export.text) for cell in row]


# Similarity

CODE = """\
camera_qos = QoSProfile(depth=3, reliability=ReliabilityPolicy.BEST_EFFORT)
def make(topic, qos, limit=4):
    found = []
    for number in range(limit):
        found.append(Publisher(topic, qos, number * 2))
    return {'camera': found, 'lidar': [p.name for p in found if p.depth > 1]}
stop_qos = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)
"""
OTHER = """\
class Rig:
    def __init__(self, node):
        self.pub = node.create_publisher(Image, 'camera/image', 5)
        self.sub = node.create_subscription(LaserScan, 'scan', self.heard, qos_profile_sensor_data)
    def heard(self, message):
        self.last = message.ranges[0] if message.ranges else None
        self.pub.publish(Image(height=480, width=640))
"""


def text(source: str) -> OwnText:
    return OwnText(tuple(source.splitlines()))


def test_a_renamed_copy_is_found_and_another_idea_is_not() -> None:
    renamed = re.sub(r"\bfound\b", "mine", CODE).replace("number", "i").replace("make", "build")
    renamed = "# all my own work\n" + renamed.replace("    ", "  ").replace("limit", "n")
    found = alike_pairs.compare_programs(
        {"ann": text(CODE), "bob": text(renamed), "cy": text(OTHER)}, NOTHING_GIVEN
    )
    assert found.pairs == (alike_pairs.AlikeSubmissions("ann", "bob", 1.0),)
    assert (found.found, found.compared) == (1, 3)


def test_given_code_and_the_stub_do_not_count(course: Course) -> None:
    given = GivenText({NOTEBOOK: course.released})
    stub = given.extract_own_text({NOTEBOOK: course.released}, {})
    assert own_tokens(stub, given, frozenset()) == ()
    solved = given.extract_own_text({NOTEBOOK: course.source}, {})
    assert own_tokens(solved, given, frozenset())
    assert alike_pairs.compare_programs({"a": stub, "b": stub}, given).too_short == ("a", "b")


ANSWER = (
    "The camera sends each picture once and nobody repeats it, because by the time a second copy "
    "arrived the robot would already look at another place and steer by what is behind it."
)


def class_with(
    answers: dict[str, str], programs: dict[str, dict[str, str]]
) -> tuple[ClassData, dict[str, dict[str, OwnText]]]:
    """Return a class of two exercises and one question, as `likeness` compares it."""
    asked = {NOTEBOOK: {"q": replace(question("q", "Loss", 1.0, written=True), model=ANSWER)}}
    data = replace(class_of({}), questions=asked)
    texts = {name: {who: text(code) for who, code in found.items()}
             for name, found in programs.items()}  # fmt: skip
    title = questions.title_of_notebook(NOTEBOOK)
    where = compared_work.answers_title(title, asked[NOTEBOOK]["q"])
    return data, {**texts, where: {who: text(said) for who, said in answers.items()}}


def test_one_copied_exercise_in_an_otherwise_own_submission_is_found_and_named() -> None:
    rng = random.Random(7)

    def own() -> str:
        names = (f"{rng.choice('abc')}.{rng.choice('xyzuvw')}" for _ in range(80))
        return "\n".join(f"{name}({rng.random()}, k={rng.random()})" for name in names)

    programs = {
        "Exercise 1": {"ann": CODE, "bob": CODE.replace("found", "mine"), "cy": OTHER},
        "Exercise 2": {who: own() for who in ("ann", "bob", "cy")},
    }
    data, texts = class_with({}, programs)
    found = compared_work.compare_class(data, texts, NOTHING_GIVEN, 0.9)
    assert found.pairs == (alike_pairs.AlikeSubmissions("ann", "bob", 1.0, "Exercise 1"),)


def test_a_copied_answer_is_found_and_the_model_answer_does_not_count() -> None:
    mine = (
        "A frame that is lost stays lost with best effort; my driver keeps the five newest ones, "
        "so the operator sees at most half a second of old pictures before the live view is back."
    )
    answers = {
        "ann": mine, "bob": mine.replace(";", ".").replace("so the", "and so the").upper(),
        "cy": ANSWER, "dan": ANSWER + " I think.",
        "eve": "Short.", "fay": "Short.",
    }  # fmt: skip
    data, texts = class_with(answers, {})
    found = compared_work.compare_class(data, texts, NOTHING_GIVEN, 0.9)
    [pair] = found.pairs
    assert (pair.left, pair.right) == ("ann", "bob")
    assert pair.where == "Exercise 1: QoS profile design: Loss"
    assert 0.9 < pair.similarity < 1.0
    assert set(found.too_short) == {"cy", "dan", "eve", "fay"}


def test_the_exemplars_own_lines_do_not_count(course: Course) -> None:
    given = GivenText({NOTEBOOK: course.released}, {NOTEBOOK: course.source})
    assert (
        own_tokens(given.extract_own_text({NOTEBOOK: course.source}, {}), given, frozenset()) == ()
    )


def test_what_many_have_is_common_ground() -> None:
    texts = {f"s{n}": text(CODE) for n in range(20)}
    assert alike_pairs.compare_programs(texts, NOTHING_GIVEN).found == 0
    few = {f"s{n}": text(CODE) for n in range(4)}
    assert alike_pairs.compare_programs(few, NOTHING_GIVEN).found == 6


def test_odd_texts_are_compared_without_a_word(recwarn: pytest.WarningsRecorder) -> None:
    for odd in (
        "(" * 5_000,
        "def f(:\n" * 50,
        "'\\d' + " * 99,
        "\x00",
        "x" + ".y" * 9_000,
        "\ud800",
    ):
        alike_pairs.compare_programs({"a": text(odd), "b": text(odd + "\n")}, NOTHING_GIVEN)
    assert not recwarn.list


def test_work_is_bounded_and_only_the_most_alike_are_shown() -> None:
    rng = random.Random(3)
    base = [f"value_{n} = call({n}, other={n})" for n in range(60)]
    texts = {
        f"s{n:04}": OwnText(
            tuple(rng.sample(base, 30)) + tuple(f"z = {rng.random()}" for _ in "ab")
        )
        for n in range(300)
    }
    assert alike_pairs.compare_programs(texts, NOTHING_GIVEN, 0.7).found == 0, (
        "all of it is common ground"
    )
    twins = {f"{s}{t}": OwnText((*(f"a{k} = {k}{s}" for k in range(20)),)) for s in range(60)
             for t in "xy"}  # fmt: skip
    found = alike_pairs.compare_programs(twins, NOTHING_GIVEN, 1.0)
    assert found.found >= 60
    assert len(found.pairs) == alike_pairs.MOST_PAIRS


def test_side_by_side_keeps_every_line_and_marks_differences() -> None:
    rows = alike_pairs.side_by_side(text("a\nb\nc"), text("a\nx\ny\nc"))
    assert [left for _, left, _ in rows if left] == ["a", "b", "c"]
    assert [right for _, _, right in rows if right] == ["a", "x", "y", "c"]
    assert [kind for kind, _, _ in rows] == ["same", "changed", "changed", "same"]
    assert alike_pairs.side_by_side(text("x\n" * 900), text("y\n" * 900))[-1][0] == "cut"


# The page


def test_everything_from_a_student_is_escaped_and_nothing_is_loaded() -> None:
    evil = f"{EVIL}$x_1$"
    data = class_of({evil: [result("x", "failed", actual=EVIL)],
                     "bob": [result("x", "grader_error", actual=EVIL)]})  # fmt: skip
    data = ClassData(
        data.root, ASSIGNMENT, 20.0, (grade(evil, waits=True), grade("bob", waits=True)),
        people={"bob": Person("bob", EVIL, EVIL), EVIL: Person(EVIL)}, records=data.records,
        not_entered=(EVIL,), notes=(EVIL,), absent=(EVIL,), left_out={"bob": frozenset({EVIL})},
    )  # fmt: skip
    texts = {EVIL: {name: text(CODE + f"print('{EVIL}')") for name in (evil, "bob")}}
    mean = means.Mean(EVIL, EVIL, 1, 0.5, 1.0, 1)
    report = reports.ClassReport(
        data, figures.check_figures(data), figures.run_times(data), feedback.common_groups(data),
        attention.people_needed(data), compared_work.compare_class(data, texts, NOTHING_GIVEN, 0.9),
        texts,
        NOTHING_GIVEN, 0.9, data.notes, means.Means((mean,), (mean,), (mean,)),
    )  # fmt: skip
    html = pages.render_page(report)
    assert report.alike.pairs
    assert "<script" not in html
    assert html.count("&lt;script&gt;") >= 18
    parsed = Links(html)
    assert parsed.loads == []
    assert parsed.open == []
    assert "http-equiv" in html


# Really graded submissions


def test_the_report_of_a_graded_class(graded: Path) -> None:
    report = reports.make_report(graded, ASSIGNMENT)
    page, canvas, moodle = reports.write_report(report)

    by_name = {check.name: check for check in report.checks}
    assert set(by_name) == set(exercises.load_exam("qos").checks)
    assert (by_name["imu_burst"].passed, by_name["imu_burst"].failed) == (2, 2)
    assert by_name["lidar_flows"].failure_rate == 0
    assert set(report.times.seconds) == {"ann", "bob", "cy", "-dan"}
    assert all(seconds > 0 for seconds in report.times.seconds.values())
    assert report.feedback[0].students == ("bob", "cy")
    urgent = {need.students: need.why for need in report.needs if need.urgent}
    assert "not valid JSON" in urgent[("eve",)]
    assert "autograder grade ch05" in urgent[("late",)]
    [waiting] = [need for need in report.needs if not need.urgent]
    assert waiting.students == ("bob", "cy")
    assert waiting.why == "Written answers of Exercise 1: QoS profile design wait for their marks."
    where = questions.title_of_notebook(NOTEBOOK)
    alike = {(p.left, p.right): p.similarity for p in report.alike.pairs if p.where == where}
    assert alike[("-dan", "ann")] == alike[("bob", "cy")] == 1.0
    assert rows_of(canvas.read_text())[2:] == [
        ["Dent, Dan", "", "", "'-dan", "", "17.5"],
        ["O'Hara, Ann", "", "", "ann", "", "17.5"],
        ["<b>Bee, Bob", "", "", "bob", "", ""],
        ["Young, Cy", "", "", "cy", "", ""],
        ["Ever, Eve", "", "", "eve", "", ""],
        ["Late, Lee", "", "", "late", "", ""],
        ["Zest, Zoe", "", "", "zoe", "", ""],
    ]
    assert [row[0] for row in rows_of(moodle.read_text())[1:]] == [
        "'-dan", "ann", "bob", "cy", "eve", "late", "zoe",
    ]  # fmt: skip
    assert report.data.absent == ("zoe",)
    by_title = {mean.title: mean for mean in report.means.questions}
    depth = by_title["History and depth"]
    assert (depth.n, depth.waiting, depth.mean) == (2, 3, 1.25)
    html = page.read_text()
    assert Links(html).loads == []
    assert Links(html).open == []
    assert "never a verdict" in html
    for said in ("Nothing, by 1 student: Zoe Zest (zoe)", "Bob &lt;b&gt;Bee (bob)", "n = 5",
                 "By learning objective"):  # fmt: skip
        assert said in html, said


@pytest.mark.parametrize("place", ["Ch05/qos-design.ipynb", "hand-in.zip"])
def test_who_handed_in_in_another_place_is_asked_about_and_gets_no_zero(
    graded: Path, place: str
) -> None:
    path = graded / "submitted" / "zoe" / place
    path.parent.mkdir(parents=True)
    path.write_text("x")
    data = collect_class(graded, ASSIGNMENT)
    assert (data.absent, data.not_entered) == ((), ("late", "zoe"))
    written = rows_of(exports.export_canvas(data, zero_absent=True).text)
    assert [row[-1] for row in written if row[3] == "zoe"] == [""]
    [need] = [need for need in attention.people_needed(data) if "zoe" in need.students]
    assert need.urgent
    assert "There is a submission but no grade" in need.why


def test_answers_of_notebooks_that_came_without_metadata_are_compared(graded: Path) -> None:
    cell = "qos-explanation-loss"
    mine = (
        "A frame that is lost stays lost with best effort; my driver keeps the five newest ones, "
        "so the operator sees at most half a second of old pictures before the live view is back."
    )
    for student in ("ann", "cy"):
        copy = graded / "autograded" / student / ASSIGNMENT / f"{NOTEBOOK}.ipynb"
        notebook = submission.read_notebook(copy)
        [answer] = [c for c in notebook.cells if submission.grade_id(c) == cell]
        answer.source = mine
        copy.chmod(0o644)
        nbformat.write(notebook, copy)
        for one in notebook.cells:
            one.metadata = nbformat.from_dict({})
        handed_in = graded / "submitted" / student / ASSIGNMENT / f"{NOTEBOOK}.ipynb"
        nbformat.write(notebook, handed_in)
    report = reports.make_report(graded, ASSIGNMENT)
    where = compared_work.answers_title(
        questions.title_of_notebook(NOTEBOOK), report.data.questions[NOTEBOOK][cell]
    )
    pairs = [pair for pair in report.alike.pairs if pair.where == where]
    assert pairs == [alike_pairs.AlikeSubmissions("ann", "cy", 1.0, where)]


@pytest.mark.parametrize(
    "damage", ["", "[]", '{"version": 1}', '{"version": 99}', "\x00" * 20, "[" * 100_000]
)
def test_a_damaged_record_costs_its_own_figures_and_says_so(graded: Path, damage: str) -> None:
    StateTable(graded / ".autograder", verdict_records.KIND, ASSIGNMENT).put(
        damage, "bob", NOTEBOOK
    )
    report = reports.make_report(graded, ASSIGNMENT)
    assert set(report.times.seconds) == {"ann", "cy", "-dan"}
    [note] = report.data.notes
    assert "bob's check results" in note
    assert "run `autograder grade ch05` again" in note


def test_a_grade_from_before_records_were_kept_is_counted(graded: Path) -> None:
    StateTable(graded / ".autograder", verdict_records.KIND, ASSIGNMENT).remove("bob", NOTEBOOK)
    [note] = reports.make_report(graded, ASSIGNMENT).data.notes
    assert "1 notebook has a grade but no record" in note


def test_the_command_speaks_to_people_and_to_machines(graded: Path) -> None:
    root = ("--root", str(graded))
    shown = autograder("report", ASSIGNMENT, *root, cwd=graded).stdout
    assert "class-report.html" in shown
    assert "The exports have points for 2 of 7 students" in shown
    assert "Empty for 4 students whose grades still wait" in shown
    assert "Empty for 1 student who handed in nothing" in shown
    assert "match them by hand: -dan" in shown
    spoken = json.loads(autograder("report", ASSIGNMENT, *root, "--json", cwd=graded).stdout)
    assert len(spoken["checks"]) == len(exercises.load_exam("qos").checks)
    assert spoken["absent"] == ["zoe"]
    assert len(spoken["means"]["questions"]) == 4
    assert {"-dan", "bob"} <= {pair["left"] for pair in spoken["alike"]}


def test_a_read_only_folder_is_one_sentence(graded: Path) -> None:
    read_only = f"mount --bind {graded} {graded} && mount -o remount,ro,bind {graded}"
    refused = autograder(
        "report", ASSIGNMENT, "--root", str(graded), cwd=graded, code=1, before=read_only
    )
    assert "cannot be written" in refused.stderr
    assert len(refused.stderr.strip().splitlines()) == 1


def test_an_assignment_that_is_not_there_or_not_graded_is_one_sentence(course: Course) -> None:
    with pytest.raises(ClassReportError, match=r"no assignment 'ch99'.*there are ch05"):
        reports.make_report(course.root, "ch99")
    with pytest.raises(ClassReportError, match=r"Nothing of 'ch05' has been graded yet: run"):
        reports.make_report(course.root, ASSIGNMENT)
    result = autograder(
        "report", "ch05", "--root", str(course.root), cwd=course.root, code=1
    ).stderr
    assert "graded yet" in result
    (course.root / "gradebook.db").write_text("this is no database, but a long enough text" * 99)
    with pytest.raises(GradebookUnusable, match="is damaged"):
        reports.make_report(course.root, ASSIGNMENT)
