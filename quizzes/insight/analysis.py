"""Item analysis: how hard each question is, how well it discriminates, and what a class believes.

Difficulty is the mean credit, p (high is easy). Discrimination is the correlation of an item's
credit with the *rest* score, the score on all other items (for right-or-wrong items the point-
biserial): with its own credit inside the total every item would seem to discriminate. Both as in
Crocker and Algina, "Introduction to Classical and Modern Test Theory", chapter 14.
"""

from __future__ import annotations

import statistics
from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from quizzes.bank import lint
from quizzes.bank.contents import Bank
from quizzes.marking.marks import Mark
from quizzes.marking.scoring import QuestionResult

FEW = 10
"""Learners below which figures say little; they are shown all the same, and marked."""
FEWEST = 3
"""Learners below which a correlation says nothing."""
FEWEST_WRONG = 5
"""Answers that are not all right below which nothing is advised: one learner can turn the figures.

The checks of an exercise are judged by it, too.
"""

EASY, HARD, FLAT = 0.95, 0.25, 0.1
"""Bounds for advice: nearly all right; no better than guessing one of four; hardly tells."""


@dataclass(frozen=True)
class ItemFigures:
    """The figures of a concept or of one of its variants.

    Attributes:
        id, kind: the item; the kind of a concept is "concept".
        concept: the concept's id.
        learners: how many answered it.
        difficulty: mean credit, 0 to 1; None if nobody answered it.
        discrimination: correlation with the rest score, -1 to 1; None if it is not defined.
        advice: what to look at, or "".
    """

    id: str
    kind: str
    concept: str
    learners: int
    difficulty: float | None
    discrimination: float | None
    advice: str


@dataclass(frozen=True)
class BeliefFigures:
    """How common a misconception is: ``holders`` showed it, of ``met`` whom a question tempted."""

    id: str
    belief: str
    holders: int
    met: int

    @property
    def share(self) -> float:
        """The share of holders among those who met it, 0 to 1."""
        return self.holders / self.met if self.met else 0.0


@dataclass(frozen=True)
class Analysis:
    """What the first attempts of a class say."""

    bank: Bank
    scores: tuple[float, ...]
    passed: int
    concepts: tuple[ItemFigures, ...]
    variants: tuple[ItemFigures, ...]
    beliefs: tuple[BeliefFigures, ...]
    notes: tuple[str, ...]

    @property
    def learners(self) -> int:
        """How many learners have an attempt that counts."""
        return len(self.scores)


def analyse_results(
    bank: Bank, results: Mapping[str, QuestionResult], notes: Iterable[str] = ()
) -> Analysis:
    """Analyse one result of each learner."""
    answered = [(mark, result) for result in results.values() for mark in result.marks]
    by_concept: defaultdict[str, list[tuple[float, float]]] = defaultdict(list)
    by_variant: defaultdict[str, list[tuple[float, float]]] = defaultdict(list)
    for mark, result in answered:
        pair = (mark.credit, sum(other.credit for other in result.marks) - mark.credit)
        by_concept[mark.item.concept.id].append(pair)
        by_variant[mark.item.variant.id].append(pair)
    concepts = tuple(_item_figures(c.id, "concept", c.id, by_concept[c.id]) for c in bank.concepts)
    variants = tuple(
        _item_figures(v.id, v.kind, c.id, by_variant[v.id])
        for c in bank.concepts
        for v in c.variants
    )
    return Analysis(
        bank,
        tuple(result.score for result in results.values()),
        sum(result.passed for result in results.values()),
        concepts,
        variants,
        _belief_figures(bank, [(learner, m) for learner, r in results.items() for m in r.marks]),
        tuple(notes),
    )


def compute_discrimination(pairs: Iterable[tuple[float, float]]) -> float | None:
    """Return the correlation of (credit, rest score) pairs.

    None where it is not defined: with fewer than three learners, or where all have the same credit
    or the same rest score. The checks of an exercise are judged by it, too.
    """
    all_pairs = list(pairs)
    earned, rest = [credit for credit, _ in all_pairs], [score for _, score in all_pairs]
    if len(all_pairs) < FEWEST or len(set(earned)) < 2 or len(set(rest)) < 2:
        return None
    try:
        return max(-1.0, min(1.0, statistics.correlation(earned, rest)))
    except statistics.StatisticsError:  # differences so small that they vanish when squared
        return None


def _item_figures(
    name: str, kind: str, concept: str, pairs: list[tuple[float, float]]
) -> ItemFigures:
    difficulty = statistics.fmean(credit for credit, _ in pairs) if pairs else None
    correlation = compute_discrimination(pairs)
    wrong = sum(credit < 1 for credit, _ in pairs)
    advice = _item_advice(len(pairs), wrong, difficulty, correlation)
    return ItemFigures(name, kind, concept, len(pairs), difficulty, correlation, advice)


def _item_advice(
    learners: int, wrong: int, difficulty: float | None, correlation: float | None
) -> str:
    if difficulty is None:
        return "nobody has answered it"
    if learners < FEW:
        return "too few learners"
    if wrong < FEWEST_WRONG:
        return ""
    if correlation is not None and correlation < -FLAT:
        return "those who know the rest get it wrong: check the key and the stem"
    if difficulty < HARD:
        return "harder than guessing: teach it again, or check the stem"
    if difficulty > EASY:
        return "nearly everybody knows it"
    if correlation is not None and correlation < FLAT:
        return "does not tell who knows from who does not"
    return ""


def _belief_figures(bank: Bank, marks: list[tuple[str, Mark]]) -> tuple[BeliefFigures, ...]:
    tempting: defaultdict[str, set[str]] = defaultdict(set)
    for answer in lint.wrong_answers(bank):
        if answer.misconception:
            tempting[answer.variant.id].add(answer.misconception)
    met: defaultdict[str, set[str]] = defaultdict(set)
    holders: defaultdict[str, set[str]] = defaultdict(set)
    for learner, mark in marks:
        for belief in tempting[mark.item.variant.id]:
            met[belief].add(learner)
        for belief in mark.misconceptions:
            holders[belief].add(learner)
            met[belief].add(learner)
    figures = (
        BeliefFigures(name, text, len(holders[name]), len(met[name]))
        for name, text in bank.misconceptions.items()
    )
    return tuple(sorted(figures, key=lambda f: (-f.share, -f.holders, f.id)))
