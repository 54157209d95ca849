"""The student's choices, read as data and compared with the key of the hidden cell."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

from autograder.examination.check_context import StudentError
from autograder.examination.exam import Exam, Failed
from autograder.exercises.patterns.rig import RobotRig
from autograder.exercises.patterns.scenarios import PATTERNS, SCENARIOS, Scenario, would_mean

VARIABLE = "choices"
READ = "Chapter 5, “When to use what”"
WORDS = ", ".join(f'"{pattern}"' for pattern in PATTERNS)


def read_choices(rig: RobotRig) -> dict[Scenario, str]:
    """Return {scenario: pattern} as the notebook has it.

    Raises:
        Failed: the variable is missing, or something in it is no pattern.
    """
    expected = f"choices has a word for each of {', '.join(SCENARIOS)}: one of {WORDS}."
    try:
        value = rig.subject.value(VARIABLE)
    except StudentError as error:
        if error.missing:
            raise Failed(expected=expected, actual=error.feedback_text) from None
        reason = str(error).partition(": ")[2] or str(error)  # without the exception's name
        raise Failed(
            expected=expected, actual=f"It could not be read: {reason.rstrip('.')}."
        ) from None
    if not isinstance(value, dict):
        raise Failed(
            expected=expected, actual=f"choices is not a dictionary but {_short_repr(value)}."
        )
    chosen: dict[Scenario, str] = {}
    wrong = []
    for scenario in SCENARIOS:
        word = value.get(scenario)
        pattern = word.strip().lower() if isinstance(word, str) else None
        if pattern in PATTERNS:
            chosen[scenario] = pattern
        elif scenario not in value:
            wrong.append(f"{scenario} is missing")
        elif word is None:
            wrong.append(f"{scenario} is still open")
        else:
            wrong.append(f"{scenario} is {_short_repr(word)}")
    if wrong:
        raise Failed(expected=expected, actual=f"In choices, {'; '.join(wrong)}.")
    return chosen


def compare_choice(rig: RobotRig, scenario: Scenario) -> str:
    """Return a remark if the choice for a scenario is right.

    Raises:
        Failed: it is not; says what it would mean in use, and nothing of what is right.
        LookupError: no key came with this part.
    """
    if scenario not in rig.bench.key:
        raise LookupError("no answer key came along: it stands in the hidden cell of the source")
    right = rig.bench.key[scenario]
    chosen = rig.memory["choices"][scenario]
    meaning = would_mean(scenario, chosen)
    if chosen not in right:
        raise Failed(
            expected="The pattern that fits best what this exchange needs.",
            actual=f'You chose "{chosen}". {meaning}',
        )
    if len(right) > 1:
        return f"More than one answer is right here. {meaning}"
    return meaning


def _short_repr(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:60]}…"


@dataclass(frozen=True)
class _Question:
    title: str
    why: str
    hints: tuple[str, str, str]


# No text names a pattern: whoever reads all of them still has to think.
_QUESTIONS: dict[Scenario, _Question] = {
    "position": _Question(
        "Requesting the robot's position: the pattern fits.",
        "Whoever asks goes on with the answer, so it has to be there at once.",
        (
            "Who begins the exchange, and how many are interested in this answer?",
            "How long does it take until the answer is there?",
            "There is nothing to wait for, no progress to hear of, and nothing to call off.",
        ),
    ),
    "camera": _Question(
        "Publishing camera images: the pattern fits.",
        "Pictures come all the time, whether anybody looks or not.",
        (
            "Who begins: the one who looks, or the one who has the pictures?",
            "How many may look at the same time, and does the camera have to know them?",
            "The data come all the time, several look, and nobody should wait for anybody.",
        ),
    ),
    "navigation": _Question(
        "Sending a navigation goal: the pattern fits.",
        "A drive takes minutes, and a lot can happen on the way.",
        (
            "How long does it take until the robot is there?",
            "What would you like to hear, and to be able to do, while it is on its way?",
            "It takes long, reports on the way, comes to an end, and can be called off.",
        ),
    ),
    "parameters": _Question(
        "Updating robot parameters: the pattern fits.",
        "A change that nobody confirms may not have happened.",
        (
            "What do you have to know after you have changed a value?",
            "How long does a change take, and how many are asked to make it?",
            "It is quick, it is between two, and it needs a yes or a no.",
        ),
    ),
    "battery": _Question(
        "Broadcasting the battery level: the pattern fits.",
        "Displays, loggers and planners come and go; the robot should not have to know them.",
        (
            "How many want to know the level, and do they have to ask?",
            "Who knows first that the level has changed?",
            "One tells, many listen, and it goes on for as long as the robot is on.",
        ),
    ),
}


def add_checks(exam: Exam[RobotRig], needs: tuple[str, ...]) -> None:
    """Give ``exam`` a check for each scenario, called ``<scenario>_choice``."""
    for scenario, question in _QUESTIONS.items():
        check = partial(compare_choice, scenario=scenario)
        check.__name__ = f"{scenario}_choice"  # type: ignore[attr-defined]
        check.__doc__ = f"{question.title}\n\n{question.why}"
        exam.check(needs=needs, hints=question.hints, read=READ)(check)
