"""What the browser gets: safe to show, complete without a request, and silent about the key."""

from __future__ import annotations

import copy
import json
import re
from pathlib import Path
from typing import Any

import pytest

from quizzes.bank import selection
from quizzes.bank.contents import Bank
from quizzes.bank.loader import load_bank, names, read_bank
from quizzes.notebook.quiz import Quiz
from quizzes.text import rendering
from quizzes.text.rendering import RenderError
from quizzes.widget import QuizWidget, widget_state
from tests.quizzes import sample
from tests.quizzes.conftest import MakeQuiz, answer_all


def traits(widget: QuizWidget) -> str:
    state = widget.get_state()
    return json.dumps({name: state[name] for name in ("paper", "answers", "result", "notice")})


def test_nothing_secret_is_in_the_state_before_submission(make_quiz: MakeQuiz) -> None:
    quiz = make_quiz()
    widget = QuizWidget(quiz)
    state = json.dumps(widget.get_state(), default=str)
    assert not re.search(sample.SECRET, state, re.IGNORECASE)
    answer_all(quiz, right=4)
    widget._update_traits()
    assert not re.search(sample.SECRET, traits(widget), re.IGNORECASE)
    quiz.submit()
    widget._update_traits()
    assert sample.SECRET in traits(widget), "the mark is one that would be found"


def other_keys(data: dict[str, Any]) -> dict[str, Any]:
    """Return the bank with other answers right, and the same texts on show."""
    changed = copy.deepcopy(data)
    for concept in changed["concepts"]:
        for variant in concept["variants"]:
            if "options" in variant:
                options = variant["options"]
                right = [bool(one.get("correct")) for one in options]
                variant["options"] = [
                    sample.option(one["text"], correct=was)
                    for one, was in zip(options, [*right[1:], right[0]], strict=True)
                ]
            elif "answer" in variant:
                variant["answer"] += 1
            elif "items" in variant:
                variant["items"] = [*variant["items"][1:], variant["items"][0]]
            else:
                rights = [pair["right"] for pair in variant["pairs"]]
                for pair, right in zip(variant["pairs"], [*rights[1:], rights[0]], strict=True):
                    pair["right"] = right
    return changed


def turned(bank: Bank, student: str) -> bool:
    """Whether an ordering was turned by one, as those are that would show the right order."""
    item = selection.draw(bank, student, 1).find_item("ordering")
    assert item is not None
    return [item.order[-1], *item.order[:-1]] == sorted(item.order)


def test_the_state_is_the_same_whatever_the_key_is(tmp_path: Path) -> None:
    kinds = ("single", "predict", "multiple", "numeric", "ordering", "matching")
    data = sample.data(kinds)
    banks = [
        read_bank(sample.write(tmp_path / name, content))
        for name, content in (("these", data), ("others", other_keys(data)))
    ]
    students = [f"student-{n}" for n in range(30)]
    students = [name for name in students if not any(turned(bank, name) for bank in banks)]
    assert len(students) > 15
    for student in students:
        keys, states = set(), set()
        for number, bank in enumerate(banks):
            quiz = Quiz(bank, student=student, folder=tmp_path / str(number))
            states.add(traits(QuizWidget(quiz)))
            keys.update((item.concept.id, selection.right_answer(item)) for item in quiz.items)
        assert len(states) == 1
        assert len(keys) == 2 * len(kinds)


@pytest.mark.parametrize("name", names())
def test_no_feedback_of_a_real_bank_is_in_the_state(name: str, tmp_path: Path) -> None:
    bank = load_bank(name)
    secrets = set(bank.misconceptions) | set(bank.misconceptions.values())
    for concept in bank.concepts:
        for variant in concept.variants:
            fields = json.loads(variant.model_dump_json())
            for part in (fields, *fields.get("options", []), *fields.get("traps", [])):
                for field in ("feedback", "wrong_feedback", "show"):
                    if part.get(field) and part[field] != variant.code:
                        secrets.add(rendering.render_plain(part[field]))
    for student in range(8):
        quiz = Quiz(bank, student=f"student-{student}", folder=tmp_path)
        shown = traits(QuizWidget(quiz))
        plain = re.sub(r"\s+", " ", re.sub(r"<[^>]*>|\\n", " ", shown))
        for secret in secrets:
            assert secret not in shown
            assert secret not in plain


def test_html_in_a_bank_is_text(make_quiz: MakeQuiz) -> None:
    paper = widget_state.paper_data(make_quiz())
    html = [q[field] for q in paper["questions"] for field in ("stem", "code")]
    html += [one["html"] for q in paper["questions"] for one in (*q["options"], *q["lefts"])]
    text = " ".join(html)
    assert "<script" not in text
    assert "&lt;script&gt;alert(1)&lt;/script&gt;" in text
    assert "<b>" not in text
    assert paper["title"] == "A sample & <i>more</i>", "the browser sets it as text"


def test_a_question_brings_all_it_needs(make_quiz: MakeQuiz) -> None:
    stem = widget_state.paper_data(make_quiz())["questions"][0]["stem"]
    assert '<span class="k">for</span>' in stem
    assert "<mfrac>" in stem
    assert 'src="data:image/svg+xml;base64,' in stem
    assert 'alt="a dot"' in stem
    assert not re.search(r'(src|href)="(?!data:)', stem)


@pytest.mark.parametrize(
    ("markdown", "html"),
    [
        ("a *b* `c<d`", "a <em>b</em> <code>c&lt;d</code>"),
        ("[x](javascript:alert(1))", "[x](javascript:alert(1))"),
        ('<img src=x onerror="a()">', "&lt;img src=x onerror=&quot;a()&quot;&gt;"),
        ("costs $5 and $6", "costs $5 and $6"),
    ],
)
def test_inline_markdown(markdown: str, html: str, tmp_path: Path) -> None:
    assert rendering.render_inline(markdown, tmp_path) == html


@pytest.mark.parametrize(
    ("latex", "says"),
    [
        (r"\text{<img src=x onerror=alert(1)>}", "is not sound"),
        (r"\text{<b>x</b>}", "makes a 'b', no formula"),
        (r"\text{<mtext onclick='a()'>x</mtext>}", "is not sound"),
        (r"\href{javascript:alert(1)}{y}", "makes a 'href'"),
        (r"\style{color:red}{x}", "makes a 'style'"),
        (r"\frac", "is not sound"),
        (r"\unknown{a}", "unknown command"),
    ],
)
def test_latex_that_is_no_formula_is_refused(latex: str, says: str, tmp_path: Path) -> None:
    with pytest.raises(RenderError) as caught:
        rendering.render_block(f"${latex}$", tmp_path)
    assert says in str(caught.value)


@pytest.mark.parametrize(
    "latex",
    [r"a<b", r"\text{a & b}", r"\frac{1}{f_s} = 100\,\text{ms}", r"\sum_{i=1}^n \sqrt[3]{x_i}",
     r"\begin{pmatrix}a&b\\c&d\end{pmatrix}", r"\mathbb{R} \ge \Delta t"],
)  # fmt: skip
def test_latex_becomes_mathml(latex: str, tmp_path: Path) -> None:
    assert "<math " in rendering.render_block(f"${latex}$ and\n\n$$\n{latex}\n$$\n", tmp_path)


def test_code_in_an_option_keeps_its_lines(tmp_path: Path) -> None:
    shown = rendering.render_inline("```python\na = 1\nb = '<'\n```", tmp_path)
    assert shown.startswith("<pre ")
    assert "\n" in shown
    assert "&lt;" in shown


def test_plain_text_has_no_marks() -> None:
    assert rendering.render_plain("**a** `b` [c](d) $x^2$\n\nnext\nline") == "a b c x^2 next line"


@pytest.mark.parametrize(
    "message",
    [
        None, 3, "x", {}, {"type": "answer"}, {"type": "submit"},
        {"type": "nonsense", "attempt": 1},
        {"type": "answer", "attempt": 1, "number": 99, "answer": "a"},
        {"type": "answer", "attempt": 1, "number": 1, "answer": "zz"},
        {"type": "answer", "attempt": 1, "number": [1], "answer": {"a": 1}},
        {"type": "answer", "attempt": 2, "number": 1, "answer": "a"},
        {"type": "submit", "attempt": 1}, {"type": "retry", "attempt": 1},
    ],
)  # fmt: skip
def test_a_strange_message_changes_nothing(make_quiz: MakeQuiz, message: Any) -> None:
    quiz = make_quiz()
    widget = QuizWidget(quiz)
    widget._on_message(widget, message, [])
    assert not any(quiz.given.values())
    assert quiz.attempts == []
    assert quiz.attempt == 1


def test_a_message_of_an_attempt_that_is_over_is_dropped(make_quiz: MakeQuiz) -> None:
    quiz = make_quiz()
    widget = QuizWidget(quiz)
    answer_all(quiz, right=5)
    for _ in range(3):
        widget._on_message(widget, {"type": "submit", "attempt": 1}, [])
    assert len(quiz.attempts) == 1
    for _ in range(3):
        widget._on_message(widget, {"type": "retry", "attempt": 1}, [])
    assert quiz.attempt == 2
    widget._on_message(widget, {"type": "submit", "attempt": 1}, [])
    assert len(quiz.attempts) == 1


def sent(quiz: Quiz, order: int, **content: Any) -> dict[str, Any]:
    return {"attempt": quiz.attempt, "view": "page", "order": order, **content}


def test_an_answer_that_was_overtaken_does_not_replace_the_newer_one(make_quiz: MakeQuiz) -> None:
    quiz = make_quiz()
    widget = QuizWidget(quiz)
    (number, newer, older) = 1, *quiz.item(1).letters[:2]
    widget._on_message(widget, sent(quiz, 3, type="answer", number=number, answer=newer), [])
    widget._on_message(widget, sent(quiz, 2, type="answer", number=number, answer=older), [])
    assert widget.answers["1"] == newer
    other = sent(quiz, 1, type="answer", number=number, answer=older)
    widget._on_message(widget, {**other, "view": "another window"}, [])
    assert widget.answers["1"] == older


def test_what_the_page_shows_is_submitted_even_if_an_answer_is_on_its_way(
    make_quiz: MakeQuiz,
) -> None:
    quiz = make_quiz()
    widget = QuizWidget(quiz)
    keys = {item.number: selection.right_answer(item) for item in quiz.items}
    for order, (number, key) in enumerate(list(keys.items())[:-1], start=1):
        widget._on_message(widget, sent(quiz, order, type="answer", number=number, answer=key), [])
    shown = {str(number): key for number, key in keys.items()}
    widget._on_message(widget, sent(quiz, 6, type="submit", answers=shown), [])
    late = sent(quiz, 5, type="answer", number=len(keys), answer=keys[len(keys)])
    widget._on_message(widget, {**late, "attempt": 1}, [])
    (attempt,) = quiz.attempts
    assert (attempt.right, widget.notice) == (len(keys), "")
