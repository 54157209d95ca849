"""Reads GIFT as Moodle does; what it cannot bring into a bank it says in one sentence."""

from __future__ import annotations

import re
from collections.abc import Iterator

from quizzes.exchange.platform_questions import (
    Choice,
    ChoiceQuestion,
    ExchangeError,
    MatchQuestion,
    Number,
    NumberQuestion,
    Question,
)

MAX_SIZE_CHARS = 4 * 1024 * 1024
"""Characters of a file that are read; a bank has about 0.1 million."""

_UNIT = re.compile(r"\\.|.", re.DOTALL)
_FORMAT = re.compile(r"\[(markdown|moodle|plain|html)\]")
_WEIGHT = re.compile(r"%(-?\d{1,3}(?:\.\d*)?)%")
_FLOAT = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_RANGE = re.compile(rf"({_FLOAT})\s*\.\.\s*({_FLOAT})")
_NUMBER = re.compile(rf"({_FLOAT})\s*(?::\s*({_FLOAT}))?")
_BLANK = " \t\n\r\v\0"


def read_gift(content: str, source: str) -> list[Question]:
    """Return the questions of a GIFT file.

    Args:
        content: the file's text.
        source: its name, for errors.

    Raises:
        ExchangeError: it is no GIFT, or has a kind of question that a bank has not.
    """
    if len(content) > MAX_SIZE_CHARS:
        raise ExchangeError(f"{source} is too large for a GIFT file: split it.")
    questions: list[Question] = []
    names: dict[str, int] = {}
    category = ""
    for line, block in _split_blocks(content):
        if block.startswith("$CATEGORY:"):
            category = block.removeprefix("$CATEGORY:").strip(_BLANK)
            continue
        question = _Block(source, line, block, category).parse_question()
        if question.name in names:
            raise ExchangeError(
                f"{source}, line {line}, question '{question.name}': line {names[question.name]} "
                "has a question of this name already; give one of them another name."
            )
        names[question.name] = line
        questions.append(question)
    if not questions:
        raise ExchangeError(f"{source} has no question in it: is it a GIFT file?")
    return questions


def unescape_text(raw: str) -> str:
    """Return what a raw piece of GIFT stands for, without blanks around it."""
    units = (_unescape_unit(unit) for unit in _UNIT.findall(raw.strip(_BLANK)))
    return "".join(units).strip(_BLANK)


def _unescape_unit(unit: str) -> str:
    if len(unit) == 1:
        return unit
    if unit[1] == "n":
        return "\n"
    return unit[1] if unit[1] in "\\~=#{}:" else unit


def _split_blocks(content: str) -> Iterator[tuple[int, str]]:
    """Yield (number of the first line, text) for what blank lines part; comments are left out."""
    content = content.removeprefix("\ufeff").replace("\r\n", "\n").replace("\r", "\n")
    lines: list[str] = []
    start = 1
    for number, line in enumerate([*content.split("\n"), ""], start=1):
        if line.strip(_BLANK):
            start = start if lines else number
            lines.append("" if line.strip(_BLANK).startswith("//") else line)
            continue
        if block := "\n".join(lines).strip(_BLANK):
            skipped = next(i for i, line in enumerate(lines) if line)
            yield start + skipped, block
        lines = []


def _find_unescaped(raw: str, wanted: str, start: int = 0) -> int:
    """Return where ``wanted`` stands unescaped, or -1."""
    position = start
    while position < len(raw):
        if raw.startswith(wanted, position):
            return position
        position += 2 if raw[position] == "\\" else 1
    return -1


def _split_unescaped(raw: str, marks: str) -> list[str]:
    """Split before each unescaped mark; each part but the first begins with its mark."""
    parts = [""]
    for unit in _UNIT.findall(raw):
        if unit in marks:
            parts.append("")
        parts[-1] += unit
    return parts


class _Block:
    """One question on its way from text; it knows where it stands."""

    def __init__(self, source: str, line: int, raw: str, category: str) -> None:
        self.source, self.line, self.category = source, line, category
        self.name = ""
        if raw.startswith("::"):
            end = _find_unescaped(raw, "::", 2)
            if end < 0:
                raise self.make_error("its name is not closed by '::'")
            self.name = unescape_text(raw[2:end])
            raw = raw[end + 2 :]
        if not self.name:
            raise self.make_error("it has no name: write ::name:: before it")
        opening, closing = _find_unescaped(raw, "{"), _find_unescaped(raw, "}")
        if opening < 0 and closing < 0:
            raise self.make_error("it has no answers in { }, and a bank holds no plain texts")
        if opening < 0 or closing < opening:
            raise self.make_error("its { and } do not fit together")
        if (
            _find_unescaped(raw, "{", opening + 1) >= 0
            or _find_unescaped(raw, "}", closing + 1) >= 0
        ):
            raise self.make_error(
                "it has more than one { }: escape those that are text as \\{ and \\}"
            )
        before, after = raw[:opening], raw[closing + 1 :]
        self.text = self.parse_text(before + ("_____" + after if after.strip(_BLANK) else ""))
        self.inside = raw[opening + 1 : closing].strip(_BLANK)
        self.feedback = ""
        general = _find_unescaped(self.inside, "####")
        if general >= 0:
            self.feedback = self.parse_text(self.inside[general + 4 :])
            self.inside = self.inside[:general].strip(_BLANK)

    def make_error(self, problem: str) -> ExchangeError:
        name = f", question '{self.name}'" if self.name else ""
        return ExchangeError(f"{self.source}, line {self.line}{name}: {problem}.")

    def parse_text(self, raw: str) -> str:
        """Return a text; it may begin with the name of its format."""
        raw = raw.strip(_BLANK)
        found = _FORMAT.match(raw)
        if found and found[1] == "html":
            raise self.make_error("a text of it is HTML; change its format to Markdown")
        return unescape_text(raw[found.end() :] if found else raw)

    def with_feedback(self, raw: str) -> tuple[str, str]:
        """Part an answer from its feedback."""
        mark = _find_unescaped(raw, "#")
        return (raw, "") if mark < 0 else (raw[:mark], self.parse_text(raw[mark + 1 :]))

    def parse_question(self) -> Question:
        if not self.text:
            raise self.make_error("it has no text")
        if not self.inside:
            raise self.make_error("it is an essay, which a bank cannot mark")
        if self.inside.startswith("#"):
            return self.parse_numbers()
        if _find_unescaped(self.inside, "~") >= 0:
            return self.parse_choices()
        if _find_unescaped(self.inside, "=") >= 0 and _find_unescaped(self.inside, "->") >= 0:
            return self.parse_matching()
        return self.true_or_false()

    def parse_choices(self) -> Question:
        first, *parts = _split_unescaped(self.inside, "~=")
        if first.strip(_BLANK):
            raise self.make_error(f"the answer {first.strip(_BLANK)!r} begins with neither = nor ~")
        one = any(part.startswith("=") for part in parts)
        choices = []
        for part in parts:
            share, rest = self.parse_weight(part[1:]) if part[0] == "~" else (100.0, part[1:])
            text, feedback = self.with_feedback(rest)
            choices.append(Choice(self.parse_text(text), share, feedback))
        right = [choice for choice in choices if choice.share > 0]
        if not all(choice.text for choice in choices):
            raise self.make_error("one of its answers has no text")
        if not right or len(choices) < 2:
            raise self.make_error("it needs at least one right and one other answer")
        if one and (len(right) > 1 or right[0].share != 100):
            raise self.make_error(
                "one choice of several (partly) right answers has no place in a bank"
            )
        return ChoiceQuestion(
            self.name, self.category, self.text, tuple(choices), one, self.feedback
        )

    def parse_weight(self, raw: str) -> tuple[float, str]:
        found = _WEIGHT.match(raw.lstrip(_BLANK))
        if not found:
            return 0.0, raw
        share = float(found[1])
        if not -100 <= share <= 100:
            raise self.make_error(f"the weight {found[0]} is not from -100 to 100")
        return share, raw.lstrip(_BLANK)[found.end() :]

    def parse_numbers(self) -> Question:
        raw, wrong_feedback = self.inside[1:], ""
        mark = _find_unescaped(raw, "~")
        if mark >= 0:
            _, wrong_feedback = self.with_feedback(raw[mark + 1 :])
            raw = raw[:mark]
        first, *parts = _split_unescaped(raw, "=")
        parts = [part[1:] for part in parts] or [first]
        numbers = tuple(self.parse_number(part) for part in parts)
        if sum(number.share == 100 for number in numbers) != 1:
            raise self.make_error("exactly one of its numbers must be right (100 %)")
        if any(number.share not in (0, 100) for number in numbers):
            raise self.make_error("a number that is partly right has no place in a bank")
        return NumberQuestion(
            self.name, self.category, self.text, numbers, wrong_feedback, self.feedback
        )

    def parse_number(self, raw: str) -> Number:
        found = _WEIGHT.match(raw.lstrip(_BLANK))
        share = float(found[1]) if found else 100.0
        rest = raw.lstrip(_BLANK)[found.end() :] if found else raw
        text, feedback = self.with_feedback(rest)
        text = text.strip(_BLANK)
        if bounds := _RANGE.fullmatch(text):
            low, high = float(bounds[1]), float(bounds[2])
            return Number((low + high) / 2, abs(high - low) / 2, share, feedback)
        if value := _NUMBER.fullmatch(text):
            return Number(float(value[1]), float(value[2] or 0), share, feedback)
        raise self.make_error(f"{text!r} is not a number with a tolerance, such as 3.5:0.1")

    def parse_matching(self) -> Question:
        pairs, extras = [], []
        for part in _split_unescaped(self.inside, "=")[1:]:
            left, arrow, right = part[1:].partition("->")
            answer = unescape_text(right)
            if not arrow or not answer:
                raise self.make_error(
                    f"the pair {part.strip(_BLANK)!r} needs a right side after ->"
                )
            if left.strip(_BLANK):
                pairs.append((self.parse_text(left), answer))
            else:
                extras.append(answer)
        if len(pairs) < 2:
            raise self.make_error("a matching needs at least two pairs")
        return MatchQuestion(
            self.name, self.category, self.text, tuple(pairs), tuple(extras), self.feedback
        )

    def true_or_false(self) -> Question:
        answer, *feedback = (part.lstrip("#") for part in _split_unescaped(self.inside, "#"))
        word = answer.strip(_BLANK).upper()
        if word not in ("T", "TRUE", "F", "FALSE"):
            raise self.make_error("it asks for a short answer, which a bank does not have")
        true = word.startswith("T")
        wrong, right = (*map(self.parse_text, feedback), "", "")[:2]
        choices = (
            Choice("True", 100.0 if true else 0.0, right if true else wrong),
            Choice("False", 0.0 if true else 100.0, wrong if true else right),
        )
        return ChoiceQuestion(self.name, self.category, self.text, choices, True, self.feedback)
