"""Item analysis: the figures are right, only first attempts count, and the page needs nothing."""

from __future__ import annotations

import csv
import json
import random
import re
from collections.abc import Callable
from html.parser import HTMLParser
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from quizzes import insight
from quizzes.attempts.quiz_answers import Answer
from quizzes.attempts.record import Attempt, Given
from quizzes.bank import loader, selection
from quizzes.bank.contents import Matching, Multiple, Numeric, Ordering
from quizzes.bank.selection import Paper, PaperItem
from quizzes.insight import analysis, item_report
from quizzes.marking import scoring
from quizzes.marking.scoring import QuestionResult

BANK = loader.load_bank("ch05")
Choose = Callable[[PaperItem], Answer]


def wrong(item: PaperItem, rng: random.Random) -> Answer:
    """An answer that is not right."""
    variant, key = item.variant, selection.right_answer(item)
    if isinstance(variant, Numeric):
        return float(rng.choice(variant.traps).value)
    letters = list(str(key))
    if isinstance(variant, Ordering | Matching):
        return "".join(letters[::-1])
    if isinstance(variant, Multiple):
        return "".join(sorted(set(item.letters) - set(letters)))
    return rng.choice(sorted(set(item.letters) - set(letters)))


def answered(paper: Paper, choose: Choose) -> QuestionResult:
    return scoring.mark_paper(paper, {item.concept.id: choose(item) for item in paper.items})


def class_of(count: int, skill: Callable[[int], float], seed: int = 1) -> dict[str, QuestionResult]:
    """Learners who know each concept with a probability of their own."""
    rng = random.Random(seed)
    return {
        f"learner-{n}": answered(
            selection.draw(BANK, f"learner-{n}", 1),
            lambda item, n=n: (  # type: ignore[misc]
                selection.right_answer(item) if rng.random() < skill(n) else wrong(item, rng)
            ),
        )
        for n in range(count)
    }


def figures_of(found: analysis.Analysis, name: str) -> analysis.ItemFigures:
    [figures] = [f for f in (*found.concepts, *found.variants) if f.id == name]
    return figures


def test_difficulty_and_discrimination_are_what_numpy_says() -> None:
    results = class_of(80, lambda n: n / 80)
    found = insight.analyse_results(BANK, results)
    for concept in BANK.concepts:
        marks = [
            (next(m.credit for m in r.marks if m.item.concept.id == concept.id), r)
            for r in results.values()
        ]
        credit = np.array([c for c, _ in marks])
        rest = np.array([sum(m.credit for m in r.marks) - c for c, r in marks])
        figures = figures_of(found, concept.id)
        assert figures.learners == 80
        assert figures.difficulty == pytest.approx(credit.mean())
        assert figures.discrimination == pytest.approx(np.corrcoef(credit, rest)[0, 1])
        assert figures.discrimination is not None
        assert figures.discrimination > 0.2, "skill decides here, so every concept discriminates"


def test_a_variants_figures_are_those_of_the_learners_who_got_it() -> None:
    results = class_of(60, lambda n: 0.5)
    found = insight.analyse_results(BANK, results)
    dealt = [m.item.variant.id for r in results.values() for m in r.marks]
    for figures in found.variants:
        assert figures.learners == dealt.count(figures.id)
    assert sum(f.learners for f in found.variants) == 60 * len(BANK.concepts)


def test_the_correlation_leaves_the_items_own_credit_out() -> None:
    # Guessing: with the own credit inside the total, the correlation would be about 0.45.
    found = insight.analyse_results(BANK, class_of(400, lambda n: 0.5))
    for figures in found.concepts:
        assert figures.discrimination is not None
        assert abs(figures.discrimination) < 0.2


@pytest.mark.parametrize(
    ("pairs", "expected"),
    [
        ([], None),
        ([(1.0, 4.0), (0.0, 0.0)], None),
        ([(1.0, 4.0), (1.0, 3.0), (1.0, 0.0)], None),
        ([(1.0, 2.0), (0.0, 2.0), (1.0, 2.0)], None),
        ([(1.0, 4.0), (1.0, 4.0), (0.0, 0.0)], 1.0),
        ([(1.0, 0.0), (0.0, 4.0), (0.0, 4.0)], -1.0),
        ([(1.0, 1e-300), (0.0, 0.0), (1.0, 0.0)], None),
    ],
)
def test_discrimination_is_only_given_where_it_is_defined(
    pairs: list[tuple[float, float]], expected: float | None
) -> None:
    assert analysis.compute_discrimination(pairs) == (
        None if expected is None else pytest.approx(expected)
    )


def test_a_key_that_those_who_know_get_wrong_is_pointed_out() -> None:
    def choose(n: int) -> Choose:
        rng = random.Random(n)
        knows = n % 2 == 0
        return lambda item: (
            selection.right_answer(item)
            if knows != (item.concept.id == "qos-purpose")
            else wrong(item, rng)
        )

    results = {f"s{n}": answered(selection.draw(BANK, f"s{n}", 1), choose(n)) for n in range(40)}
    figures = figures_of(insight.analyse_results(BANK, results), "qos-purpose")
    assert figures.discrimination == pytest.approx(-1, abs=0.05)
    assert "check the key" in figures.advice


def test_nothing_is_advised_on_fewer_than_five_wrong_answers() -> None:
    asked, other = "qos-purpose", "service-vs-action"

    def advice(learners: int, failing: int) -> str:
        rng = random.Random(1)

        def choose(n: int) -> Choose:
            fails = {asked: n < failing, other: n % 2 == 0}
            return lambda item: (
                wrong(item, rng) if fails.get(item.concept.id) else selection.right_answer(item)
            )

        results = {
            f"s{n}": answered(selection.draw(BANK, f"s{n}", 1), choose(n)) for n in range(learners)
        }
        return figures_of(insight.analyse_results(BANK, results), asked).advice

    assert advice(9, 8) == "too few learners"
    assert [advice(learners, 4) for learners in (10, 12, 400)] == ["", "", ""]
    assert "does not tell" in advice(12, 6)
    assert "harder than guessing" in advice(12, 11)
    assert advice(400, 5) == "nearly everybody knows it"


def test_misconceptions_are_counted_among_those_whom_a_question_tempted() -> None:
    def falls_for(belief: str) -> Choose:
        def choose(item: PaperItem) -> Answer:
            for place, option in enumerate(getattr(item.variant, "options", [])):
                if option.misconception == belief:
                    return item.letters_of([place])
            return selection.right_answer(item)

        return choose

    belief = "topic-stores-messages"
    results = {
        f"s{n}": answered(selection.draw(BANK, f"s{n}", 1), falls_for(belief)) for n in range(50)
    }
    found = insight.analyse_results(BANK, results)
    figures = {f.id: f for f in found.beliefs}
    tempted = sum(
        any(belief in str(m.item.variant.model_dump()) for m in r.marks) for r in results.values()
    )
    assert 0 < tempted < 50
    assert (figures[belief].holders, figures[belief].met) == (tempted, tempted)
    assert found.beliefs[0].id == belief
    assert figures[belief].share == 1.0
    assert sum(f.holders for f in found.beliefs) == tempted


def attempt(student: str, number: int, choose: Choose) -> Attempt:
    paper = selection.draw(BANK, student, number)
    result = answered(paper, choose)
    given = {m.item.concept.id: Given(m.item.variant.id, m.answer) for m in result.marks}
    return Attempt(
        BANK.quiz, student, number, BANK.edition, "2026-01-01T00:00:00+00:00",
        given, result.score, result.right, result.passed,
    )  # fmt: skip


def content(*attempts: Attempt) -> bytes:
    return "".join(one.to_json() + "\n" for one in attempts).encode()


def all_wrong(item: PaperItem) -> Answer:
    return wrong(item, random.Random(0))


def test_the_first_attempt_counts_and_is_marked_again() -> None:
    first, second = attempt("ann", 1, all_wrong), attempt("ann", 2, selection.right_answer)
    forged = Attempt(**{**vars(first), "score": 5.0, "right": 5, "passed": True})
    collected = insight.collect_class(BANK, {"ann": content(second, forged)})
    assert collected.results["ann"].paper.attempt == 1
    assert collected.results["ann"].right == 0


def test_what_cannot_be_counted_is_said_and_stops_nothing() -> None:
    other = attempt("cem", 1, selection.right_answer)
    collected = insight.collect_class(BANK, {
        "ann": content(attempt("ann", 1, selection.right_answer)),
        "ben": None,
        "cem": content(Attempt(**{**vars(other), "edition": "0" * 16})),
        "dee": b"\xff\xfe not json\n[1, 2]\n{}\n",
    })  # fmt: skip
    assert list(collected.results) == ["ann"]
    notes = dict(zip(("ben", "cem", "dee"), collected.notes, strict=True))
    assert notes["ben"] == "ben has handed in no quiz-ch05.attempts.jsonl."
    assert "another edition" in notes["cem"]
    assert "holds no attempt that counts" in notes["dee"]


class Page(HTMLParser):
    """What a page would load, run or show."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.requests: list[str] = []
        self.scripts = 0
        self.ids: list[str] = []
        self.text = ""
        self.feed(html)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.scripts += tag == "script"
        for name, value in attrs:
            self.scripts += name.startswith("on")
            if name == "id" and value:
                self.ids.append(value)
            loads = name in ("src", "href", "xlink:href", "action")
            if loads and not (value or "").startswith("#"):
                self.requests.append(str(value))

    def handle_data(self, data: str) -> None:
        self.text += data


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    found = insight.analyse_results(
        BANK, class_of(60, lambda n: n / 60), ["<script>alert(1)</script> has handed in nothing."]
    )
    paths = insight.write_report(found, tmp_path_factory.mktemp("report") / "new")
    return {path.name: path.read_text(encoding="utf-8") for path in paths}


def test_the_page_stands_alone(written: dict[str, str]) -> None:
    page = Page(written["quiz-ch05-report.html"])
    assert page.requests == []
    assert page.scripts == 0
    assert len(set(page.ids)) == len(page.ids)
    assert "url(http" not in written["quiz-ch05-report.html"]
    assert "@import" not in written["quiz-ch05-report.html"]


def test_the_page_escapes_what_it_is_given(written: dict[str, str]) -> None:
    assert (
        "&lt;script&gt;alert(1)&lt;/script&gt; has handed in nothing."
        in (written["quiz-ch05-report.html"])
    )


def test_the_plots_show_the_figures_and_say_in_words_what_they_are(
    written: dict[str, str],
) -> None:
    plots = re.findall(r"<svg.*?</svg>", written["quiz-ch05-report.html"], re.DOTALL)
    assert len(plots) == 3
    for plot in plots:
        root = ElementTree.fromstring(plot)  # well-formed, and its texts are texts
        assert root.attrib["role"] == "img"
        assert root.attrib["aria-label"]
    assert "discrimination" in plots[1]
    rows = list(csv.DictReader(written["quiz-ch05-items.csv"].splitlines()))
    drawn = [row for row in rows if row["kind"] != "concept" and row["discrimination"]]
    numbers = re.findall(r">\d \(n = (\d+)\)</text>", plots[1])
    assert numbers == [row["learners"] for row in drawn]
    assert ">points in the first attempt (n = 60)</text>" in plots[0]
    assert re.search(r">\d+ of \d+</text>", plots[2])


def test_page_and_csv_have_the_same_figures(written: dict[str, str]) -> None:
    page = Page(written["quiz-ch05-report.html"])
    items = list(csv.DictReader(written["quiz-ch05-items.csv"].splitlines()))
    assert len(items) == len(BANK.concepts) + sum(len(c.variants) for c in BANK.concepts)
    for row in items:
        joined = "".join(row[column] for column in item_report.ITEM_COLUMNS)
        assert joined in page.text
    beliefs = list(csv.DictReader(written["quiz-ch05-misconceptions.csv"].splitlines()))
    assert {row["misconception"] for row in beliefs} == set(BANK.misconceptions)
    shares = [float(row["share"]) for row in beliefs if row["share"]]
    assert shares == sorted(shares, reverse=True)


def test_the_same_class_gives_the_same_page(written: dict[str, str]) -> None:
    found = insight.analyse_results(
        BANK, class_of(60, lambda n: n / 60), ["<script>alert(1)</script> has handed in nothing."]
    )
    assert item_report.render_page(found) == written["quiz-ch05-report.html"]


@pytest.mark.parametrize("count", [0, 1, 2])
def test_a_very_small_class_gets_a_page_that_says_so(tmp_path: Path, count: int) -> None:
    found = insight.analyse_results(BANK, class_of(count, lambda n: 0.5))
    paths = insight.write_report(found, tmp_path)
    text = Page(paths[0].read_text(encoding="utf-8")).text
    assert "With fewer than 10 learners these figures say little." in text
    assert "nan" not in text


def test_a_class_that_knows_everything_gets_a_page(tmp_path: Path) -> None:
    found = insight.analyse_results(BANK, class_of(20, lambda n: 1.0))
    assert found.passed == 20
    text = Page(insight.write_report(found, tmp_path)[0].read_text(encoding="utf-8")).text
    assert "20 passed" in text
    assert {figures.advice for figures in found.concepts} == {""}, "nobody was wrong"
    assert json.dumps([f.holders for f in found.beliefs]).count("0") == len(found.beliefs)


def test_a_folder_that_is_a_file_is_one_sentence(tmp_path: Path) -> None:
    (tmp_path / "taken").write_text("a file")
    found = insight.analyse_results(BANK, {})
    with pytest.raises(item_report.ReportError, match=r"cannot be written in .*taken"):
        insight.write_report(found, tmp_path / "taken")
