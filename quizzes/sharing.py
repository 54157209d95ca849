"""Attempts that were handed in by several people: the one thing that a file says of its making.

A quiz that is taken at home knows what was answered, not by whom. But no two people submit the same
answers at the same moment under the same login, so whoever hands in the same attempts has one file.
"""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Mapping

from quizzes import record
from quizzes.record import Attempt

CANNOT_KNOW = (
    "A quiz knows what was answered, and under which login. It cannot know who answered, who "
    "helped, or whether somebody has copied attempts and changed them: only hand-ins that hold the "
    "very same attempts are named, and points are taken from nobody. Marks that must be someone's "
    "own need an exam under supervision."
)


def same_attempts(quiz: str, contents: Mapping[str, bytes]) -> list[tuple[str, ...]]:
    """Return groups of people in whose files the same attempts at a quiz stand.

    Args:
        quiz: its name.
        contents: for each person what their file of attempts holds.
    """
    having: defaultdict[str, set[str]] = defaultdict(set)
    for person, content in contents.items():
        for attempt in record.parse(content)[0]:
            if attempt.quiz == quiz:
                having[_identity(attempt)].add(person)
    groups: list[set[str]] = []
    for people in having.values():
        if len(people) > 1:
            apart = [group for group in groups if not group & people]
            joined = people.union(*(group for group in groups if group & people))
            groups = [*apart, joined]
    return sorted(tuple(sorted(group)) for group in groups)


def _identity(attempt: Attempt) -> str:
    """Return what two attempts have in common if one is a copy; scores are not looked at."""
    answers = sorted((name, given.variant, given.answer) for name, given in attempt.answers.items())
    return json.dumps([attempt.student, attempt.attempt, attempt.submitted, answers])
