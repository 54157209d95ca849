"""Find attempts that several people have handed in: the one thing that a file tells of its making.

A quiz that is taken at home knows what was answered, not by whom. But no two people submit the same
answers at the same moment under the same login, so people who hand in the same attempts have copies
of one file, even if one answer of a copy was changed.
"""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Iterator, Mapping

from quizzes.attempts import record
from quizzes.attempts.quiz_answers import Answer, parse_number
from quizzes.attempts.record import Attempt

CANNOT_KNOW = (
    "A quiz knows what was answered, and under which login. It cannot know who answered, who "
    "helped, or whether somebody has copied attempts and changed their login, time or answers: "
    "only hand-ins that hold the very same attempts, but for one answer, are named, and points are "
    "taken from nobody. Marks that must be someone's own need an exam under supervision."
)

FEWEST, MOST = 3, 50
"""Answers of an attempt of which one may be another in a copy: of fewer, too little is the same."""


def same_attempts(quiz: str, contents: Mapping[str, bytes]) -> list[tuple[str, ...]]:
    """Return groups of people in whose files the same attempts at a quiz stand.

    Args:
        quiz: its name.
        contents: for each person what their file of attempts holds.
    """
    having: defaultdict[str, set[str]] = defaultdict(set)
    for person, content in contents.items():
        for attempt in record.parse_attempts(content)[0]:
            if attempt.quiz == quiz:
                for identity in _attempt_identities(attempt):
                    having[identity].add(person)
    groups: list[set[str]] = []
    for people in having.values():
        if len(people) > 1:
            apart = [group for group in groups if not group & people]
            joined = people.union(*(group for group in groups if group & people))
            groups = [*apart, joined]
    return sorted(tuple(sorted(group)) for group in groups)


def _attempt_identities(attempt: Attempt) -> Iterator[str]:
    """Yield what two attempts have in common, one or the other, if one is a copy.

    All answers, or all but one of them; scores are not looked at.
    """
    answers = sorted(
        (name, given.variant, _comparable_answer(given.answer))
        for name, given in attempt.answers.items()
    )
    same = [answers]
    if FEWEST <= len(answers) <= MOST:
        same += [answers[:place] + answers[place + 1 :] for place in range(len(answers))]
    for some in same:
        yield json.dumps([attempt.student, attempt.attempt, attempt.submitted, some])


def _comparable_answer(answer: Answer) -> Answer:
    """Return what an answer has in common with others that may be marked alike: its letters."""
    try:
        return parse_number(answer)
    except ValueError:
        return "".join(sorted(filter(str.isalnum, str(answer).casefold())))
