"""What the browser gets to show, as plain data; every text is rendered here, in the kernel."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from quizzes.bank import selection
from quizzes.bank.contents import Matching, Multiple, Numeric
from quizzes.bank.selection import PaperItem
from quizzes.marking import wording
from quizzes.marking.marks import Mark
from quizzes.taking.quiz_core import QuizCore
from quizzes.text import rendering


def paper_data(quiz: QuizCore) -> dict[str, Any]:
    """Return the questions of the attempt at hand: texts and letters, and nothing of the key."""
    return {
        "title": quiz.bank.title,
        "chapter": quiz.bank.chapter,
        "attempt": quiz.attempt,
        "needed": quiz.bank.pass_text,
        "standing": _describe_standing(quiz),
        "more": quiz.more,
        "questions": [_question_data(item, quiz.bank.folder) for item in quiz.items],
    }


def _describe_standing(quiz: QuizCore) -> str:
    """Return the first and the best score in words; empty before the first attempt."""
    first, best = quiz.first, quiz.best
    if first is None or best is None:
        return ""
    counted = quiz.bank.attempt_limit
    if quiz.bank.keyless:
        return f"Handed in: {len(quiz.counted)} of {counted}."
    most = len(quiz.bank.concepts)
    passed = "passed" if any(attempt.passed for attempt in quiz.counted) else "not passed yet"
    practice = quiz.attempt > counted
    return (
        f"First attempt: {first.score:g} of {most}. Best: {best.score:g} of {most} "
        f"(attempt {best.attempt}). So far: {passed}."
        + (f" The first {counted} attempts count: this one is practice." if practice else "")
    )


def _question_data(item: PaperItem, folder: Path) -> dict[str, Any]:
    variant = item.variant
    lefts = [pair.left for pair in variant.pairs] if isinstance(variant, Matching) else []
    return {
        "number": item.number,
        "kind": variant.kind,
        "instruction": wording.INSTRUCTIONS[variant.kind],
        "stem": rendering.render_block(variant.stem, folder),
        "code": rendering.render_code(variant.code) if variant.code else "",
        "unit": variant.unit if isinstance(variant, Numeric) else "",
        "lefts": [
            {"html": rendering.render_inline(left, folder), "text": rendering.render_plain(left)}
            for left in lefts
        ],
        "options": [
            {
                "letter": letter,
                "html": rendering.render_inline(item.text_of(letter), folder),
                "text": rendering.render_plain(item.text_of(letter)),
            }
            for letter in item.letters
        ],
    }


def result_data(quiz: QuizCore) -> dict[str, Any] | None:
    """Return what came of the attempt at hand; None before it is submitted.

    Of a quiz that is marked elsewhere ``passed`` is None, and there are no marks.
    """
    if quiz.result is None:
        return None
    marks = [] if quiz.bank.keyless else quiz.result.marks
    return {
        "attempt": quiz.attempt,
        "headline": quiz.result.headline,
        "passed": None if quiz.bank.keyless else quiz.result.passed,
        "marks": [_mark_data(mark, quiz.bank.folder) for mark in marks],
    }


def _mark_data(mark: Mark, folder: Path) -> dict[str, Any]:
    variant = mark.item.variant
    several = isinstance(variant, Multiple)
    key = (
        ""
        if mark.is_right or several
        else wording.of_answer(mark.item, selection.right_answer(mark.item))
    )
    return {
        "number": mark.item.number,
        "right": mark.is_right,
        "verdict": wording.describe_mark(mark),
        "key": rendering.render_inline(key, folder) if key else "",
        "run": _cell_data(variant.code) if variant.kind == "predict" and variant.code else None,
        "remarks": [
            {
                "letter": remark.letter if several else "",
                "right": remark.right,
                "html": rendering.render_block(remark.feedback, folder),
                "show": _cell_data(remark.show) if remark.show and not remark.right else None,
            }
            for remark in mark.remarks
        ],
    }


def _cell_data(source: str) -> dict[str, str]:
    return {"html": rendering.render_code(source), "source": source.strip("\n") + "\n"}
