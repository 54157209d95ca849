"""One submitted attempt as a line of JSON, and back again from a file that anyone may have written.

A reader takes nothing on trust: sizes, types and ranges are checked before anything is used.
"""

from __future__ import annotations

import codecs
import json
import os
import stat
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from quizzes.attempts.quiz_answers import Answer, parse_number

VERSION = 1
MAX_LINE_BYTES = 64 * 1024
MAX_FILE_BYTES = 4 * 1024 * 1024
"""Bytes of a line and of a file that are read; an attempt has about 1 kB."""

MAX_TEXT_CHARS = 200


@dataclass(frozen=True)
class Given:
    """What was answered to one concept: the variant that was shown, and the answer to it."""

    variant: str
    answer: Answer


@dataclass(frozen=True)
class Attempt:
    """One submitted attempt.

    ``edition`` is the bank's (`quizzes.bank.contents.Bank.edition`), ``submitted`` the UTC time in
    ISO 8601, ``answers`` is by concept. ``score``, ``right`` and ``passed`` are as marked at that
    time.
    """

    quiz: str
    student: str
    attempt: int
    edition: str
    submitted: str
    answers: dict[str, Given]
    score: float
    right: int
    passed: bool
    version: int = VERSION

    def to_json(self) -> str:
        """Return the attempt as one line of JSON."""
        return json.dumps(asdict(self), ensure_ascii=False, allow_nan=False)


def attempts_filename(quiz: str) -> str:
    """Return the name of the file with the attempts of a quiz."""
    return f"quiz-{quiz}.attempts.jsonl"


def read_plain(path: Path, most: int) -> bytes:
    """Return what a file that somebody handed in holds, at most its first ``most`` bytes.

    A link is not followed, and what is no plain file (a pipe, a device) is not waited for.

    Raises:
        OSError: it cannot be read.
    """
    handle = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC)
    with os.fdopen(handle, "rb") as file:
        if not stat.S_ISREG(os.fstat(handle).st_mode):
            raise OSError("it is not a plain file")
        return file.read(most)


def parse_attempts(content: bytes) -> tuple[list[Attempt], int]:
    """Return the attempts in a file's content, and how many of its lines are none."""
    attempts, damaged = [], 0
    # An editor may have put a byte order mark in front.
    for line in content[:MAX_FILE_BYTES].removeprefix(codecs.BOM_UTF8).split(b"\n"):
        if not line.strip():
            continue
        try:
            attempts.append(_parse_attempt(line))
        except (ValueError, KeyError, TypeError, RecursionError, AttributeError):
            damaged += 1
    return attempts, damaged + (len(content) > MAX_FILE_BYTES)


def _parse_attempt(line: bytes) -> Attempt:
    if len(line) > MAX_LINE_BYTES:
        raise ValueError("too long")
    data = json.loads(line.decode("utf-8"))
    # Half of a surrogate pair is legal in JSON, but no text that can be hashed or written.
    json.dumps(data, ensure_ascii=False).encode("utf-8")
    if data["version"] != VERSION or not data.keys() <= Attempt.__dataclass_fields__.keys():
        raise ValueError("not of this version")
    for name in ("quiz", "student", "edition", "submitted"):
        _require_valid(isinstance(data[name], str) and len(data[name]) <= MAX_TEXT_CHARS)
    for name in ("attempt", "right"):
        _require_valid(type(data[name]) is int and 0 <= data[name] < 10**6)
    _require_valid(data["attempt"] > 0 and type(data["passed"]) is bool)
    _require_valid(type(data["score"]) in (int, float))
    parse_number(data["score"])
    answers = {str(name): _parse_given(given) for name, given in data["answers"].items()}
    return Attempt(**{**data, "answers": answers})


def _parse_given(data: Any) -> Given:
    variant, answer = data["variant"], data["answer"]
    _require_valid(data.keys() == {"variant", "answer"} and isinstance(variant, str))
    if type(answer) in (int, float):
        answer = parse_number(answer)
    _require_valid(
        isinstance(answer, float) or (isinstance(answer, str) and len(answer) <= MAX_TEXT_CHARS)
    )
    return Given(variant, answer)


def _require_valid(holds: bool) -> None:
    if not holds:
        raise ValueError("a value of the wrong kind")
