"""The bank of chapter 5: its questions, its proofs, and every cell that it offers to run."""

from __future__ import annotations

import ast
import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest

from quizzes.bank import lint, loader
from quizzes.bank.contents import Bank, Predict
from tests.kernel import Kernel
from tests.quizzes.bank.shown_ch05 import SHOWN

BANK = loader.load_bank("ch05")
PROOFS = Path(__file__).parents[1] / "proofs"

REQUIRED = {
    "topic-stores-messages",
    "one-node-one-process",
    "broker-must-run",
    "callbacks-without-spinning",
    "services-suit-streams",
    "sync-call-in-callback-is-safe",
    "action-is-slow-service",
    "cancel-stops-at-once",
    "qos-must-be-equal",
    "best-effort-satisfies-reliable",
    "depth-affects-matching",
    "transient-local-one-side",
}


def show_cells(bank: Bank) -> dict[str, str]:
    """Every different `show` cell, by the place where it stands first."""
    cells: dict[str, str] = {}
    for place in lint.wrong_answers(bank):
        if place.show is not None:
            cells.setdefault(place.show, f"{place.variant.id}/{place.misconception}")
    return {name: source for source, name in cells.items()}


SHOWS = show_cells(BANK)


def beliefs_of(bank: Bank) -> dict[str, set[str]]:
    """Every different `show` cell, with the misconceptions that it is offered for."""
    names = {source: name for name, source in show_cells(bank).items()}
    beliefs: dict[str, set[str]] = {name: set() for name in names.values()}
    for place in lint.wrong_answers(bank):
        if place.show is not None:
            beliefs[names[place.show]].add(str(place.misconception))
    return beliefs


PREDICTIONS = {
    variant.id: variant
    for concept in BANK.concepts
    for variant in concept.variants
    if isinstance(variant, Predict)
}


def clean_output(kernel: Kernel, cell: str) -> str:
    """What a cell printed; it must raise nothing and write nothing to stderr."""
    status, shown = kernel.run(cell)
    assert (status, [text for kind, text in shown if kind in ("stderr", "error")]) == ("ok", [])
    printed = "".join(text for kind, text in shown if kind == "stdout")
    assert printed.strip()
    return printed


@pytest.fixture(scope="module")
def kernel() -> Iterator[Kernel]:
    """One kernel for all cells: a learner runs them in one notebook, too."""
    opened = Kernel()
    yield opened
    opened.close()


def test_the_five_questions_of_the_chapter_are_the_five_concepts() -> None:
    assert [concept.id for concept in BANK.concepts] == [
        "qos-purpose",
        "pattern-camera",
        "reliable-guarantee",
        "pattern-navigation",
        "service-vs-action",
    ]
    assert BANK.pass_text == "4 of 5 needed"
    assert all(len(concept.variants) >= 4 for concept in BANK.concepts)


def test_all_kinds_of_question_are_used() -> None:
    kinds = Counter(v.kind for concept in BANK.concepts for v in concept.variants)
    assert set(kinds) == {"single", "multiple", "numeric", "ordering", "matching", "predict"}


def test_the_common_misconceptions_are_there() -> None:
    assert set(BANK.misconceptions) >= REQUIRED


def test_every_wrong_answer_can_be_shown() -> None:
    assert [p.where for p in lint.wrong_answers(BANK) if p.show is None] == []


def test_the_lint_finds_nothing() -> None:
    assert [str(finding) for finding in lint.list_findings(BANK)] == []


def test_every_proof_exists_and_every_proof_is_named_by_a_variant() -> None:
    written = {
        f"{path.name}::{node.name}"
        for path in PROOFS.glob("test_*.py")
        for node in ast.parse(path.read_text(encoding="utf-8")).body
        if isinstance(node, ast.FunctionDef) and node.name.startswith("test_")
    }
    named = {
        proof for concept in BANK.concepts for variant in concept.variants
        for proof in variant.proof
    }  # fmt: skip
    assert named == written


def test_for_every_belief_it_is_said_what_its_cell_must_print() -> None:
    assert {name: set(beliefs) for name, beliefs in SHOWN.items()} == beliefs_of(BANK)


@pytest.mark.parametrize("name", SHOWS)
def test_a_show_cell_prints_what_corrects_its_beliefs(kernel: Kernel, name: str) -> None:
    printed = clean_output(kernel, SHOWS[name]).strip()
    for belief, pattern in SHOWN[name].items():
        assert re.search(pattern, printed, re.DOTALL), (belief, printed)


@pytest.mark.parametrize("name", SHOWS)
def test_no_show_cell_prints_its_conclusion_as_a_fixed_sentence(name: str) -> None:
    """What corrects a belief comes from live nodes: the code alone does not hold it."""
    fixed = [
        node.value for node in ast.walk(ast.parse(SHOWS[name]))
        if isinstance(node, ast.Constant) and isinstance(node.value, str)
    ]  # fmt: skip
    for pattern in SHOWN[name].values():
        assert not any(re.search(pattern, text, re.DOTALL) for text in fixed)


@pytest.mark.parametrize("name", PREDICTIONS)
def test_a_prediction_comes_true(kernel: Kernel, name: str) -> None:
    variant = PREDICTIONS[name]
    printed = clean_output(kernel, variant.code).strip().splitlines()[-1]
    outcomes = {option.text: option.correct for option in variant.options}
    assert outcomes[f"`{printed}`"]


def test_cells_do_not_touch_the_learners_own_nodes(kernel: Kernel) -> None:
    """A show cell opens its own session: the notebook's one, and its nodes, stay as they are."""
    look = "print(list(course.session().nodes), course.session().domain_id)"
    mine = "import course\nfrom rclpy.node import Node\nmine = course.run(Node, 'mine')\n"
    before = clean_output(kernel, mine + look)
    assert "'/mine'" in before
    clean_output(kernel, SHOWS["qos-purpose-1/topic-stores-messages"])
    assert clean_output(kernel, look) == before


def test_no_cell_sleeps() -> None:
    for source in [*SHOWS.values(), *(v.code for v in PREDICTIONS.values())]:
        assert not re.search(r"\bsleep\(", source)


def test_pictures_say_in_words_what_they_show() -> None:
    text = (loader.BANKS / "ch05.yaml").read_text(encoding="utf-8")
    pictures = re.findall(r"!\[(.*?)\]\((.*?)\)", text)
    assert pictures
    for words, path in pictures:
        assert len(words) > 20
        assert (loader.BANKS / path).is_file()
