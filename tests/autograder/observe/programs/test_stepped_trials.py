"""Trials in plain programs: hastily in one, and what was not right there again with patience."""

from __future__ import annotations

from collections.abc import Iterable
from types import SimpleNamespace
from typing import Any

import pytest

from autograder.examination.exam import Failed, NotExaminable
from autograder.observe.programs.stepped_trials import SteppedTrials, as_not_examinable

WRONG = Failed(expected="Ten a second come.", actual="Five came.")
Outcomes = dict[str, Failed | None]


class Scripted(SteppedTrials[Any]):
    """Trials whose programs have the outcomes that a test says."""

    def script(self, *outcomes: Outcomes) -> list[tuple[list[str], bool]]:
        runs: list[tuple[list[str], bool]] = []
        left = list(outcomes)

        def run(_: Any, __: Any, names: Iterable[str], *, hasty: bool) -> Outcomes:
            runs.append((list(names), hasty))
            return left.pop(0)

        object.__setattr__(self, "_run", run)
        return runs


def trials() -> Scripted:
    made = dict.fromkeys(("rate", "level", "stop"), lambda _: None)
    return Scripted("Node", 1, lambda *_: None, made, lambda _, names: names)  # type: ignore[arg-type,return-value]


def bench() -> Any:
    return SimpleNamespace(programs=object(), memory={})


def test_where_there_are_no_programs_nothing_is_required() -> None:
    trials().require(SimpleNamespace(programs=None, memory={}), "rate")  # type: ignore[arg-type]


def test_what_is_right_in_haste_is_seen_in_one_program() -> None:
    made, given = trials(), bench()
    runs = made.script({"level": None, "stop": None})
    made.require(given, "level")
    made.require(given, "stop")
    assert runs == [(["level", "stop"], True)]


def test_what_is_wrong_in_haste_has_all_patience_once() -> None:
    made, given = trials(), bench()
    runs = made.script({"rate": WRONG, "level": None}, {"rate": None})
    made.require(given, "rate")
    made.require(given, "rate")
    assert runs == [(["rate", "level", "stop"], True), (["rate"], False)]


def test_what_is_wrong_with_patience_is_a_finding() -> None:
    made, given = trials(), bench()
    runs = made.script({"rate": WRONG}, {"rate": WRONG})
    for _ in range(2):
        with pytest.raises(Failed, match="Five came"):
            made.require(given, "rate")
    assert len(runs) == 2


def test_what_could_not_be_seen_is_nobodys_fault() -> None:
    made, given = trials(), bench()
    made.script({}, {})
    with pytest.raises(NotExaminable, match="could not be seen"):
        made.require(given, "rate")


def test_where_what_comes_before_fails_nothing_can_be_told() -> None:
    with pytest.raises(NotExaminable), as_not_examinable():
        raise WRONG
