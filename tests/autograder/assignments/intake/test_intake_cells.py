"""Cells that have lost nbgrader's metadata are recognised, or a person is asked about them."""

from __future__ import annotations

import copy
from collections.abc import Callable

import nbformat
import pytest
from nbformat import NotebookNode
from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook, new_raw_cell

from autograder.assignments import submission
from autograder.assignments.intake.recognition import cell_matching
from autograder.assignments.intake.recognition.cell_matching import Recognised

STUB = "def design():\n    return None\n\n\ndepth = 1"
WORK = "def design():\n    return 'mine'\n\n\ndepth = 5"
CHECK = "from autograder import check\n\ncheck('qos')"
BLANK = "*Your answer goes here.*"
QUESTIONS = {name: f"### Why {name}?\n\nSay it in two sentences." for name in ("loss", "depth")}


def cell(kind: Callable[..., NotebookNode], name: str, source: str, **flags: bool) -> NotebookNode:
    data = {"grade": False, "locked": False, "solution": False, **flags}
    data |= {"grade_id": name, "schema_version": 3} | ({"points": 2} if data["grade"] else {})
    return kind(source, id=name, metadata={"nbgrader": data})


def released() -> NotebookNode:
    code, text = new_code_cell, new_markdown_cell
    cells = [
        cell(text, "task", "# Exercise 1: quality of service\n\nWhat to do.", locked=True),
        cell(code, "given", "import course\n\nsession = course.session()", locked=True),
        cell(code, "solution", STUB, solution=True),
        cell(code, "visible", CHECK, locked=True, grade=True),
        cell(code, "hidden", "# Filled in when graded.", locked=True, grade=True),
    ]
    for name, question in QUESTIONS.items():
        cells.append(cell(text, f"question-{name}", question, locked=True))
        cells.append(cell(text, f"answer-{name}", BLANK, grade=True, solution=True))
    return new_notebook(cells=cells)


ANSWERS = ("answer-loss", "answer-depth")
GIVEN = {"answer-loss": "Nobody loses.", "answer-depth": "One is enough."}


def worked_on(**others: str) -> NotebookNode:
    """Return the notebook with everything done, or with ``others`` in some cells."""
    notebook = released()
    texts = {"solution": WORK, **GIVEN, **{k.replace("_", "-"): v for k, v in others.items()}}
    for one in notebook.cells:
        one.source = texts.get(submission.grade_id(one), one.source)
    return notebook


def stripped(notebook: NotebookNode, *names: str) -> NotebookNode:
    """Return it without nbgrader's metadata and the cells' ids: in all cells, or in these."""
    for number, one in enumerate(notebook.cells):
        if not names or submission.grade_id(one) in names:
            one.metadata = nbformat.from_dict({})
            one.id = f"lost-{number}"
    return notebook


def without(notebook: NotebookNode, *names: str) -> NotebookNode:
    notebook.cells = [c for c in notebook.cells if submission.grade_id(c) not in names]
    return notebook


def at(notebook: NotebookNode, name: str) -> int:
    return [submission.grade_id(c) for c in notebook.cells].index(name)


def mended(notebook: NotebookNode) -> tuple[dict[str, str], Recognised, NotebookNode]:
    """Return {grade id: text} after everything is put right, what was said, and the notebook."""
    known = cell_matching.recognise_cells(notebook, released())
    whole, _ = submission.restore_cells(notebook, released(), released())
    ids = [name for one in whole.cells if (name := submission.grade_id(one))]
    assert sorted(ids) == sorted(submission.grade_id(c) for c in released().cells)
    texts = {submission.grade_id(one): one.source for one in whole.cells}
    return {"solution": texts["solution"], **{a: texts[a] for a in ANSWERS}}, known, whole


RIGHT = {"solution": WORK, **GIVEN}


def code(notebook: NotebookNode) -> str:
    return "\n".join(c.source for c in submission.extract_program(notebook))


def test_an_honest_notebook_is_left_as_it_is() -> None:
    notebook = worked_on()
    notebook.cells.insert(3, new_code_cell("depth"))
    notebook.cells.insert(0, new_markdown_cell("My notes."))
    before = copy.deepcopy(notebook)
    known = cell_matching.recognise_cells(notebook, released())
    assert (known, notebook) == (Recognised(), before)


def test_an_untouched_notebook_is_left_as_it_is() -> None:
    notebook = released()
    assert cell_matching.recognise_cells(notebook, released()) == Recognised()
    assert notebook == released()
    assert mended(stripped(released()))[1].doubts == {}


def test_a_notebook_without_any_metadata_is_recognised() -> None:
    texts, known, _ = mended(stripped(worked_on()))
    assert texts == RIGHT
    assert known.doubts == {}
    assert known.notes == [cell_matching.LOST]


@pytest.mark.parametrize(
    ("name", "called"),
    [
        ("solution", "solution"),
        ("visible", "Exercise 1: quality of service"),
        ("answer-loss", "Why loss?"),
        ("answer-depth", "Why depth?"),
        ("question-loss", "question-loss"),
    ],
)
def test_a_cell_without_metadata_is_recognised_and_called_by_its_question(
    name: str, called: str
) -> None:
    texts, known, _ = mended(stripped(worked_on(), name))
    assert (texts, known.doubts) == (RIGHT, {})
    assert f"'{called}'" in known.notes[0]


def test_a_cell_that_has_kept_its_id_alone_is_recognised() -> None:
    notebook = worked_on()
    for one in notebook.cells:
        one.metadata = nbformat.from_dict({})
    texts, known, _ = mended(notebook)
    assert (texts, known.doubts) == (RIGHT, {})


def test_answers_keep_their_order_where_the_questions_are_gone() -> None:
    notebook = without(worked_on(), "question-loss", "question-depth")
    texts, known, _ = mended(stripped(notebook, *ANSWERS))
    assert (texts, known.doubts) == (RIGHT, {})


def test_some_answers_left_out_are_empty_and_nobody_is_asked() -> None:
    texts, known, _ = mended(stripped(worked_on(answer_loss=BLANK)))
    assert texts == {**RIGHT, "answer-loss": BLANK}
    assert known.doubts == {}


@pytest.mark.parametrize("lost", [(), ("solution",)])
def test_a_solution_split_in_two_is_run_whole(lost: tuple[str, ...]) -> None:
    notebook = worked_on()
    here = at(notebook, "solution")
    first, second = WORK.split("\n\n\n")
    notebook.cells[here].source = first
    notebook.cells.insert(here + 1, new_code_cell(second))
    _, known, whole = mended(stripped(notebook, *lost))
    assert known.doubts == {}
    assert first in code(whole)
    assert second in code(whole)
    assert "return None" not in code(whole)


def merged(notebook: NotebookNode, one: str, other: str, keeps: str) -> NotebookNode:
    """Return it with two neighbouring cells merged into one, which ``keeps`` one's metadata."""
    here = at(notebook, one)
    first, second = notebook.cells[here : here + 2]
    assert submission.grade_id(second) == other
    kept = first if keeps == one else second
    kept.source = f"{first.source}\n\n{second.source}"
    notebook.cells[here : here + 2] = [kept]
    return notebook


@pytest.mark.parametrize("keeps", ["first", "second", "neither"])
@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("given", "solution"), ("solution", "visible"),
        ("question-loss", "answer-loss"), ("answer-loss", "question-depth"),
    ],
)  # fmt: skip
def test_merged_cells_are_taken_apart(one: str, other: str, keeps: str) -> None:
    name = {"first": one, "second": other, "neither": one}[keeps]
    notebook = merged(worked_on(), one, other, name)
    texts, known, whole = mended(stripped(notebook, name) if keeps == "neither" else notebook)
    assert texts == RIGHT
    assert known.doubts == {}
    assert code(whole).count("session = ") == 1


def test_three_merged_cells_are_taken_apart() -> None:
    twice = merged(worked_on(), "given", "solution", "given")
    notebook = merged(twice, "given", "visible", "given")
    texts, known, whole = mended(notebook)
    assert (texts, known.doubts) == (RIGHT, {})
    assert code(whole).count("def design") == 1


@pytest.mark.parametrize("kind", [new_raw_cell, new_code_cell])
def test_answers_of_another_type_are_recognised(kind: Callable[..., NotebookNode]) -> None:
    notebook = worked_on()
    for name in ANSWERS:
        notebook.cells[at(notebook, name)] = kind(GIVEN[name])
    texts, known, whole = mended(notebook)
    assert (texts, known.doubts) == (RIGHT, {})
    assert whole.cells[at(whole, "answer-loss")].cell_type == "markdown"
    assert "Nobody" not in code(whole), "prose is not run"


@pytest.mark.parametrize("kind", [new_raw_cell, new_markdown_cell])
def test_code_of_another_type_is_recognised(kind: Callable[..., NotebookNode]) -> None:
    notebook = worked_on()
    notebook.cells[at(notebook, "solution")] = kind(WORK)
    texts, known, whole = mended(notebook)
    assert (texts, known.doubts) == (RIGHT, {})
    assert "'mine'" in code(whole)


@pytest.mark.parametrize("blank", [BLANK, "", "  \n"])
def test_answers_below_the_empty_cells_count(blank: str) -> None:
    notebook = worked_on(answer_loss=blank, answer_depth=blank)
    for name in ANSWERS:
        notebook.cells.insert(at(notebook, name) + 1, new_markdown_cell(GIVEN[name]))
    texts, known, _ = mended(notebook)
    assert (texts, known.doubts) == (RIGHT, {})
    assert known.notes == [
        f"Your answer to 'Why {name}?' stood in a cell beside it; it counts." for name in QUESTIONS
    ]


def test_an_answer_in_two_cells_is_one_with_its_pictures() -> None:
    notebook = worked_on(answer_loss=BLANK)
    picture = {"plot.png": {"image/png": "AAAA"}}
    below = [new_markdown_cell("First."), new_markdown_cell("Then.", attachments=picture)]
    here = at(notebook, "answer-loss") + 1
    notebook.cells[here:here] = below
    texts, known, whole = mended(notebook)
    assert texts["answer-loss"] == "First.\n\nThen."
    assert whole.cells[at(whole, "answer-loss")].attachments == picture
    assert known.doubts == {}


def test_all_answers_in_one_cell_at_the_end_are_asked_about() -> None:
    notebook = worked_on(answer_loss=BLANK, answer_depth=BLANK)
    notebook.cells.append(new_markdown_cell("Loss: nobody. Depth: one."))
    _, known, _ = mended(notebook)
    assert "answer-loss" in known.doubts


def test_one_text_for_two_answers_that_are_gone_is_asked_about() -> None:
    notebook = without(worked_on(), *ANSWERS, "question-loss", "question-depth")
    notebook.cells.append(new_markdown_cell("Loss: nobody. Depth: one."))
    _, known, _ = mended(notebook)
    assert set(known.doubts) == set(ANSWERS)


def test_an_answer_typed_into_a_question_that_was_changed_is_asked_about() -> None:
    notebook = worked_on(answer_loss=BLANK, question_loss="### Loss\n\nNobody loses anything.")
    _, known, _ = mended(notebook)
    assert set(known.doubts) == {"answer-loss"}


@pytest.mark.parametrize("above", ["question-loss", "task", "solution"])
@pytest.mark.parametrize("kind", [new_markdown_cell, new_raw_cell])
def test_text_above_the_question_of_a_blank_answer_is_asked_about(
    kind: Callable[..., NotebookNode], above: str
) -> None:
    notebook = worked_on(answer_loss=BLANK)
    notebook.cells.insert(at(notebook, above), kind(GIVEN["answer-loss"]))
    texts, known, _ = mended(notebook)
    assert texts == {**RIGHT, "answer-loss": BLANK}
    assert set(known.doubts) == {"answer-loss"}


@pytest.mark.parametrize("name", ["task", "question-depth"])
def test_an_answer_typed_into_another_given_text_is_asked_about(name: str) -> None:
    notebook = worked_on(answer_loss=BLANK)
    here = notebook.cells[at(notebook, name)]
    here.source = here.source.replace(".", f", and {GIVEN['answer-loss']}")
    _, known, _ = mended(notebook)
    assert set(known.doubts) == {"answer-loss"}


def test_code_that_may_be_the_missing_solution_is_asked_about() -> None:
    notebook = worked_on()
    notebook.cells[at(notebook, "solution")] = new_code_cell("class Other:\n    pass")
    texts, known, whole = mended(notebook)
    assert set(known.doubts) == {"visible", "hidden"}
    assert texts["solution"] == "", "the stub is not examined in its place"
    assert "class Other" in code(whole)


def test_code_in_a_given_cell_that_was_changed_is_asked_about() -> None:
    notebook = without(worked_on(given=f"import course, time\n\n{WORK}"), "solution")
    texts, known, _ = mended(notebook)
    assert set(known.doubts) == {"visible", "hidden"}
    assert texts["solution"] == ""


def test_a_solution_that_was_deleted_without_any_other_code_comes_back_as_the_stub() -> None:
    texts, known, _ = mended(without(worked_on(), "solution"))
    assert texts["solution"] == STUB
    assert known.doubts == {}


def test_work_in_another_cell_of_the_assignment_is_found() -> None:
    two = released()
    second = cell(new_code_cell, "second", "def finish():\n    pass", solution=True)
    two.cells.insert(at(two, "visible"), second)
    notebook = copy.deepcopy(two)
    both = f"{WORK}\n\n\ndef finish():\n    return 'done'"
    notebook.cells[at(notebook, "solution")].source = both
    known = cell_matching.recognise_cells(without(notebook, "second"), two)
    whole, _ = submission.restore_cells(notebook, two, two)
    assert known.doubts == {}
    assert code(whole).count("def finish") == 1


def test_a_stub_that_defines_nothing_is_known_by_its_place() -> None:
    empty = released()
    empty.cells[at(empty, "solution")].source = "# Your work goes here."
    notebook = stripped(worked_on(), "solution")
    known = cell_matching.recognise_cells(notebook, empty)
    assert known.doubts == {}
    assert notebook.cells[at(notebook, "solution")].source == WORK


@pytest.mark.parametrize(
    "source",
    [
        "",
        "x" * 200_000,
        "def (",
        "\x00",
        "(" * 5000,
        "-" * 50_000 + "1",
        "x = '\\d'",
        "%matplotlib\n!ls\n?help",
    ],
)
def test_whatever_stands_in_a_cell_stops_nothing(source: str) -> None:
    notebook = stripped(worked_on())
    notebook.cells += [new_code_cell(source), new_markdown_cell(source), new_raw_cell(source)]
    mended(notebook)


def test_a_notebook_is_known_by_half_of_what_was_given() -> None:
    assert cell_matching.measure_likeness(stripped(worked_on()), released()) == 1.0
    assert (
        cell_matching.measure_likeness(new_notebook(cells=[new_code_cell(WORK)]), released()) == 0.0
    )
    half = without(worked_on(), "task", "given", "visible")
    assert cell_matching.measure_likeness(stripped(half), released()) == 0.5


def test_an_import_added_inside_a_given_cell_is_run_as_well() -> None:
    notebook = worked_on(given="import course\nimport math\n\nsession = course.session()")
    _, known, whole = mended(notebook)
    assert "import math" in code(whole)
    assert code(whole).index("session = course.session()") < code(whole).index("import math")
    assert any("run as it was given, and then as you have it" in note for note in known.notes)
    assert not known.doubts


@pytest.mark.parametrize("kept", ["stub", "nothing"])
def test_work_below_the_check_that_examines_it_is_asked_about(kept: str) -> None:
    notebook = worked_on(solution=STUB)
    if kept == "nothing":
        notebook = without(notebook, "solution")
    notebook.cells.insert(at(notebook, "hidden"), new_code_cell(WORK))
    _, known, _ = mended(notebook)
    assert set(known.doubts) >= {"visible", "hidden"}
    assert "cells are run from the top" in known.doubts["visible"]


def test_trials_below_a_check_are_nothing_to_ask_about() -> None:
    notebook = worked_on()
    notebook.cells.insert(at(notebook, "hidden"), new_code_cell("depth = 7\nprint(design())"))
    assert not mended(notebook)[1].doubts


@pytest.mark.parametrize("text", ["# Nobody loses.", '"""Nobody loses."""'])
def test_an_answer_typed_as_a_comment_or_a_string_is_one(text: str) -> None:
    notebook = worked_on(answer_loss=BLANK)
    notebook.cells.insert(at(notebook, "answer-loss") + 1, new_code_cell(text))
    assert mended(notebook)[0]["answer-loss"] == text


def test_an_answer_that_was_split_with_its_metadata_is_whole() -> None:
    notebook = worked_on()
    second = copy.deepcopy(notebook.cells[at(notebook, "answer-loss")])
    second.id, second.source = "second", "And if somebody does, it is told."
    notebook.cells.insert(at(notebook, "answer-loss") + 1, second)
    texts, known, _ = mended(notebook)
    assert texts["answer-loss"] == "Nobody loses.\n\nAnd if somebody does, it is told."
    assert any("stood in 2 cells; all of them count" in note for note in known.notes)
