"""The student's choices, read as data and compared with the key of the hidden cell."""

from __future__ import annotations

from autograder.bench import StudentError
from autograder.exam import Failed
from autograder.rigs.robot import RobotRig
from autograder.rigs.scenarios import PATTERNS, SCENARIOS, Scenario, would_mean

VARIABLE = "choices"
WORDS = ", ".join(f'"{pattern}"' for pattern in PATTERNS)


def read(rig: RobotRig) -> dict[Scenario, str]:
    """Return {scenario: pattern} as the notebook has it.

    Raises:
        Failed: the variable is missing, or something in it is no pattern.
    """
    expected = f"choices has a word for each of {', '.join(SCENARIOS)}: one of {WORDS}."
    try:
        value = rig.subject.value(VARIABLE)
    except StudentError as error:
        raise Failed(expected=expected, actual=f"It could not be read: {error}.") from None
    if not isinstance(value, dict):
        raise Failed(expected=expected, actual=f"choices is not a dictionary but {_few(value)}.")
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
            wrong.append(f"{scenario} is {_few(word)}")
    if wrong:
        raise Failed(expected=expected, actual=f"In choices, {'; '.join(wrong)}.")
    return chosen


def compare(rig: RobotRig, scenario: Scenario) -> str:
    """Return a remark if the choice for a scenario is right.

    Raises:
        Failed: it is not; says what it would mean in use, and nothing of what is right.
        LookupError: no key came with this part.
    """
    if scenario not in rig.key:
        raise LookupError("no answer key came along: it stands in the hidden cell of the source")
    right = rig.key[scenario]
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


def _few(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:60]}…"
