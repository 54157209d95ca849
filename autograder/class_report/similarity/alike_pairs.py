"""Submissions that are alike: a hint where to look, never a verdict.

Exercise by exercise, and for each answer in words, what two students wrote is compared by the
normalised Indel similarity of their own tokens (`own_text`): twice the length of the longest common
subsequence, by the sum of both lengths. So one exercise that was copied is found in a submission
that is otherwise somebody's own. What the assignment itself says does not count, nor do lines of
code that a good part of the class has.
"""

from __future__ import annotations

import difflib
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import combinations

from rapidfuzz import process
from rapidfuzz.distance import Indel

from autograder.class_report.similarity.own_text import (
    MAX_TOKENS,
    GivenText,
    OwnText,
    common_ground,
    own_tokens,
    own_words,
)

THRESHOLD = 0.9
"""Likeness from which a pair is shown, 0 to 1."""
FEWEST_TOKENS = 40
"""Own tokens below which likeness says nothing: so little turns out alike by chance."""
FEWEST_WORDS = 15
"""Own words of an answer below which likeness says nothing: two or three sentences have thirty."""
MOST_PAIRS = 40
"""Most pairs that are shown side by side; the table's heading says how many there are."""
MOST_LINES = 250
"""Most lines of a side that are shown."""
MOST_WORK = 800_000
"""Tokens of a whole class that are compared: 800 of each of 1,000 submissions. The time grows with
its square, so that a class of any size, handing in what it likes, takes minutes at most."""
BLOCK = 256
"""Submissions compared with all others at a time, which bounds the memory."""


@dataclass(frozen=True)
class AlikeSubmissions:
    """Two students whose work is alike: ``similarity`` from 0 to 1, ``where`` says of what."""

    left: str
    right: str
    similarity: float
    where: str = ""


@dataclass(frozen=True)
class Similarity:
    """What the comparison of a class found.

    Attributes:
        pairs: the most alike first, at most `MOST_PAIRS`.
        found: how many pairs reach the threshold in all.
        compared: how many texts were compared: programs and answers.
        too_short: students who wrote too little to say anything, once for each text.
    """

    pairs: tuple[AlikeSubmissions, ...]
    found: int
    compared: int
    too_short: tuple[str, ...]


def compare_programs(
    texts: Mapping[str, OwnText],
    given: GivenText,
    threshold: float = THRESHOLD,
    where: str = "",
    work: int = MOST_WORK,
) -> Similarity:
    """Compare every student's program with every other's.

    Args:
        texts: {student: what they wrote}.
        given: the assignment's own code.
        threshold: similarity from which a pair is reported.
        where: what the pairs are to be called by.
        work: tokens of the class that are compared.
    """
    common = common_ground(texts.values())
    most = max(FEWEST_TOKENS, min(MAX_TOKENS, work // max(1, len(texts))))
    own = {student: own_tokens(text, given, common, most) for student, text in texts.items()}
    return _compare_texts(own, FEWEST_TOKENS, threshold, where)


def alike_in_words(
    texts: Mapping[str, OwnText], given: str, threshold: float = THRESHOLD, where: str = ""
) -> Similarity:
    """Compare every student's answer with every other's; arguments as in `compare_programs`.

    ``given`` is the question with its model answer.
    """
    most = MOST_WORK // max(1, len(texts))
    own = {student: own_words(text, given)[:most] for student, text in texts.items()}
    return _compare_texts(own, FEWEST_WORDS, threshold, where)


def merge_findings(found: Iterable[Similarity]) -> Similarity:
    """Return what several comparisons have found as one."""
    every = list(found)
    return Similarity(
        tuple(_top_pairs([pair for likeness in every for pair in likeness.pairs])),
        sum(likeness.found for likeness in every),
        sum(likeness.compared for likeness in every),
        tuple(student for likeness in every for student in likeness.too_short),
    )


def _compare_texts(
    own: Mapping[str, tuple[str, ...]], fewest: int, threshold: float, where: str
) -> Similarity:
    long_enough = {student: text for student, text in own.items() if len(text) >= fewest}
    same: defaultdict[tuple[str, ...], list[str]] = defaultdict(list)
    for student in sorted(long_enough):
        same[long_enough[student]].append(student)
    found = 0
    best: list[AlikeSubmissions] = []
    for similarity, left, right in _score_pairs(same, threshold):
        found += 1
        best.append(AlikeSubmissions(min(left, right), max(left, right), similarity, where))
        if len(best) > 50 * MOST_PAIRS:
            best = _top_pairs(best)
    short = tuple(sorted(own.keys() - long_enough.keys()))
    return Similarity(tuple(_top_pairs(best)), found, len(long_enough), short)


def side_by_side(left: OwnText, right: OwnText) -> list[tuple[str, str, str]]:
    """Return rows (kind, left line, right line), kind being "same", "changed" or "cut"."""
    a, b = left.lines[:MOST_LINES], right.lines[:MOST_LINES]
    rows: list[tuple[str, str, str]] = []
    matcher = difflib.SequenceMatcher(None, a, b, autojunk=False)
    for tag, a1, a2, b1, b2 in matcher.get_opcodes():
        kind = "same" if tag == "equal" else "changed"
        for n in range(max(a2 - a1, b2 - b1)):
            rows.append((
                kind,
                a[a1 + n] if a1 + n < a2 else "",
                b[b1 + n] if b1 + n < b2 else "",
            ))  # fmt: skip
    if len(left.lines) > MOST_LINES or len(right.lines) > MOST_LINES:
        rows.append(("cut", _rest_text(left), _rest_text(right)))
    return rows


def _rest_text(text: OwnText) -> str:
    more = len(text.lines) - MOST_LINES
    return f"… {more} more lines" if more > 0 else ""


def _score_pairs(
    same: Mapping[tuple[str, ...], list[str]], threshold: float
) -> Iterator[tuple[float, str, str]]:
    for group in same.values():
        for left, right in combinations(group, 2):
            yield 1.0, left, right
    unique = list(same)
    encoded = _encode_texts(unique)
    for start in range(0, len(unique), BLOCK):
        block = encoded[start : start + BLOCK]
        # Only what stands to the right of the diagonal: each pair once.
        matrix = process.cdist(
            block, encoded[start:], scorer=Indel.normalized_similarity, score_cutoff=threshold,
            workers=-1,
        )  # fmt: skip
        for row, column in zip(*(matrix >= threshold).nonzero(), strict=True):
            if row < column:
                for left in same[unique[start + row]]:
                    for right in same[unique[start + column]]:
                        yield float(matrix[row, column]), left, right


def _encode_texts(texts: list[tuple[str, ...]]) -> list[str]:
    """Return each text as a string with one character a token, which compares fastest."""
    counts = Counter(token for text in texts for token in set(text))
    # Rare tokens beyond what Unicode has room for share one character: they count as equal.
    codes = {token: chr(min(n, 50_000) + 1) for n, (token, _) in enumerate(counts.most_common())}
    return ["".join(codes[token] for token in text) for text in texts]


def _top_pairs(pairs: list[AlikeSubmissions]) -> list[AlikeSubmissions]:
    return sorted(pairs, key=lambda p: (-p.similarity, p.where, p.left, p.right))[:MOST_PAIRS]
