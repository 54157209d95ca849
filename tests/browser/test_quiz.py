"""The quiz in a real JupyterLab in a real browser, by keyboard alone."""

from __future__ import annotations

import json
import os
import re
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from playwright.sync_api import expect

from quizzes.bank import selection
from quizzes.bank.loader import load_bank, read_bank
from quizzes.marking import closed_quizzes, regrade
from quizzes.notebook.quiz import Quiz
from quizzes.text import rendering
from tests.quizzes import sample

from .conftest import OpenNotebook
from .lab import Lab
from .quizzing import STUDENT, Learner, write_notebook

pytestmark = [pytest.mark.timeout(900), pytest.mark.xdist_group("browser: grading")]

Sit = Callable[..., Learner]


@pytest.fixture
def sit(
    lab: Lab, open_notebook: OpenNotebook, tmp_path: Path, request: pytest.FixtureRequest
) -> Sit:
    """Open a notebook with a quiz in a folder of its own, and sit a learner in front of it."""
    name = re.sub(r"\W+", "-", request.node.name)

    def make(
        quiz: str = sample.NAME, *, attempts: Path | None = None, closed: bool = False
    ) -> Learner:
        banks = tmp_path / "banks"
        real = quiz != sample.NAME
        data = {**sample.data(), "closed": closed}
        bank = load_bank(quiz) if real else read_bank(sample.write(banks, data))
        path = write_notebook(lab.work / name, None if real or closed else banks, quiz, attempts)
        if closed:
            (path.parent / closed_quizzes.sheet_filename(quiz)).write_text(
                closed_quizzes.make_sheet(bank)
            )
            shutil.copytree(banks / "assets", path.parent / "assets")
        window = open_notebook(path.relative_to(lab.work))
        learner = Learner(window, Quiz(bank, student=STUDENT, folder=tmp_path / "elsewhere"))
        learner.start()
        return learner

    return make


def test_pass_with_four_of_five_by_keyboard_alone(sit: Sit) -> None:
    learner = sit()
    learner.take(right=4)
    expect(learner.result).to_have_text(re.compile("^Passed: 4 of 5 right.*4 of 5 needed"))
    expect(learner.result).to_be_focused()
    (attempt,) = learner.attempts()
    assert (attempt["right"], attempt["passed"], attempt["student"]) == (4, True, STUDENT)
    assert learner.window.errors == []
    assert learner.window.foreign_requests() == []


def test_fail_with_three_of_five_then_try_again_and_pass_by_keyboard_alone(sit: Sit) -> None:
    learner = sit()
    learner.take(right=3)
    expect(learner.result).to_have_text(re.compile("^Not passed yet: 3 of 5 right"))
    expect(learner.root.locator(".quiz-verdict").nth(4)).to_contain_text("Question 5: not right")
    learner.tab_to(learner.retry)
    learner.page.keyboard.press("Enter")
    expect(learner.root.locator(".quiz-title")).to_be_focused()
    expect(learner.root.locator(".quiz-meta")).to_contain_text(
        re.compile(r"Attempt 2\..*First attempt: 3.* of 5\. Best: 3")
    )
    quiz = learner.quiz
    for item in quiz.items:  # the same attempt here, so that the next one is dealt
        quiz.answer(item.number, selection.right_answer(item))
    quiz.submit()
    quiz.retry()
    learner.take(right=5)
    expect(learner.result).to_have_text(re.compile("^Passed: 5 of 5 right"))
    assert [attempt["right"] for attempt in learner.attempts()] == [3, 5]
    assert learner.window.errors == []


def test_the_real_quiz_is_passed_by_keyboard_alone(sit: Sit) -> None:
    learner = sit("ch05")
    learner.take(right=5)
    expect(learner.result).to_have_text(re.compile("^Passed: 5 of 5 right"))
    assert learner.window.errors == []
    assert learner.window.foreign_requests() == []


SHORTCUTS = (
    "x", "a", "b", "c", "v", "z", "d", "d", "m", "y", "r", "1", "h", "j", "k", "Escape", "Shift+M",
    "ArrowUp", "ArrowDown", "ArrowLeft", "ArrowRight", "Enter", "o", "i", "i", "0", "0",
)  # fmt: skip
"""JupyterLab's keys in command mode: cut, insert, copy, paste, delete, change, move, run."""


@pytest.mark.parametrize("submitted", [False, True], ids=["answering", "reading"])
def test_no_shortcut_of_jupyterlab_leaves_a_control(sit: Sit, submitted: bool) -> None:
    learner = sit()
    if submitted:
        learner.take(right=3)
        for summary in learner.root.locator("summary").all():
            summary.click()
    page, window = learner.page, learner.window
    before = (window.cells(), _modes(learner))
    controls = learner.root.locator(
        "input:enabled, select:enabled, button:enabled:visible, pre, summary, [tabindex]"
    )
    kinds: set[str] = set()
    for control in controls.element_handles():  # these stay the same while rows move
        kind = control.evaluate("element => element.type || element.tagName.toLowerCase()")
        keys = [] if kind in kinds else list(SHORTCUTS)  # all keys on the first of each kind,
        kinds.add(kind)
        keys += ["x", "a", "d", "d", "ArrowUp", "ArrowDown", "Escape"]  # these on every one
        if control.evaluate("element => element.matches('.quiz-main, summary')"):
            keys = [key for key in keys if key != "Enter"]  # Enter would submit, or hide others
        for index, key in enumerate(keys):
            if index == 0 or len(keys) > len(SHORTCUTS):
                control.focus()
            page.keyboard.press(key)
        assert (window.cells(), _modes(learner)) == before, kind
    expect(learner.root).to_have_count(1)
    needed = {"pre", "h2", "button"} | ({"summary", "p"} if submitted else set())
    assert needed <= kinds
    if not submitted:
        assert {"radio", "checkbox", "number", "select-one"} <= kinds
    assert len(learner.attempts()) == int(submitted)


def _modes(learner: Learner) -> list[str]:
    """Return the notebook's mode, and the type of each of its cells."""
    modes: list[str] = learner.page.evaluate(
        "() => { const notebook = window.jupyterapp.shell.currentWidget.content;"
        " return [notebook.mode, ...notebook.widgets.map(cell => cell.model.type)] }"
    )
    return modes


def test_without_its_guards_a_control_would_let_shortcuts_through(sit: Sit) -> None:
    """Guards the test above: the keys are shortcuts there, and the quiz is what holds them."""
    learner = sit()
    learner.root.evaluate(
        """root => {
            const bare = root.cloneNode(true); // without listeners
            for (const element of bare.querySelectorAll('[data-lm-suppress-shortcuts]'))
                element.removeAttribute('data-lm-suppress-shortcuts');
            root.replaceWith(bare);
        }"""
    )
    learner.question(1).locator("input").first.focus()
    learner.page.keyboard.press("x")
    learner.page.wait_for_function(
        "() => window.jupyterapp.shell.currentWidget.content.widgets.length === 2"
    )


def test_a_screen_reader_finds_roles_names_and_states(sit: Sit) -> None:
    learner = sit()
    snapshot = learner.root.aria_snapshot().replace("- '", "- ")  # YAML's quotes
    for line in (
        "- region \"A sample & <i>more</i>\"",
        '- heading "A sample & <i>more</i>" [level=2]',
        '- group "Question 1 of 5 What will this cell show? Choose one."',
        '- group "Question 2 of 5 Choose all that are right."',
        '- group "Question 3 of 5 Give a number."',
        '- group "Question 4 of 5 Put these in order."',
        '- group "Question 5 of 5 Choose for each what belongs to it."',
        "- radio \"a)", "- checkbox \"a)", "- spinbutton \"Your answer: s\"",
        "- button \"Move up: step", "- button \"Move down: step",
        "- combobox \"left x", "- option \"choose…\" [selected]",
        "- img \"a dot\"", '- region "Code"', "- button \"Submit answers\"", "- math",
    ):  # fmt: skip
        assert line in snapshot, snapshot
    assert snapshot.count("- radio") == 4
    fieldset = learner.question(3)
    stem = fieldset.get_attribute("aria-describedby")
    assert stem is not None
    expect(learner.page.locator(f"#{stem.split()[0]}")).to_contain_text("Stem")

    learner.tab_to(learner.submit)
    learner.page.keyboard.press("Enter")
    status = learner.root.locator(".quiz-status")
    expect(status).to_have_text("Not submitted yet: question 1 has no complete answer.")
    assert status.get_attribute("role") == "status"
    expect(learner.question(1).locator("input").first).to_be_focused()
    learner.take(right=4)
    done = learner.root.aria_snapshot()
    assert "Question 5: not right" in done
    assert "[disabled]" in done
    assert learner.result.get_attribute("tabindex") == "-1"


def test_a_double_click_records_one_attempt(sit: Sit) -> None:
    learner = sit()
    for item in learner.quiz.items:
        learner.answer_by_keyboard(item, selection.right_answer(item))
    learner.submit.dblclick()
    learner.result.filter(has_text="needed").wait_for()
    learner.window.command("notebook:run-all-cells")
    learner.window.wait_until_ready()
    assert len(learner.attempts()) == 1


def test_answers_are_there_after_a_reload_and_after_a_restart(sit: Sit) -> None:
    learner = sit()
    items = learner.quiz.items
    for item in items[:3]:
        learner.answer_by_keyboard(item, selection.right_answer(item))
    learner.saved()
    learner.window.save()

    def still_there() -> None:
        for letter in str(selection.right_answer(items[1])):
            expect(learner.question(2).locator(f'input[value="{letter}"]')).to_be_checked()
        expect(learner.question(1).locator("input:checked")).to_have_value(
            str(selection.right_answer(items[0]))
        )
        expect(learner.question(3).locator("input")).to_have_value(
            f"{selection.right_answer(items[2]):g}"
        )

    learner.window.reload()
    still_there()
    expect(learner.submit).to_be_enabled()

    learner.window.restart_kernel()
    alarm = learner.root.get_by_role("alert")
    expect(alarm).to_contain_text("The kernel of this notebook was restarted")
    expect(alarm).to_contain_text("Run this cell again: your answers and attempts are kept.")
    expect(learner.submit).to_be_disabled()
    expect(learner.question(1).locator("input").first).to_be_disabled()

    learner.start()
    still_there()
    expect(alarm).to_have_text("")
    for item in items[3:]:
        learner.answer_by_keyboard(item, selection.right_answer(item))
    learner.tab_to(learner.submit)
    learner.page.keyboard.press("Enter")
    expect(learner.result).to_have_text(re.compile("^Passed: 5 of 5"))

    learner.window.restart_kernel()
    learner.start()
    expect(learner.result).to_have_text(re.compile("^Passed: 5 of 5"))
    expect(learner.retry).to_be_enabled()
    assert len(learner.attempts()) == 1
    # JupyterLab itself complains about its own requests that a restart cuts off.
    cut_off = "Canceled future for"
    assert [error for error in learner.window.errors if cut_off not in error] == []


def test_a_quiz_that_is_opened_again_without_its_kernel_says_what_to_do(sit: Sit) -> None:
    learner = sit()
    gone = learner.page.locator(".quiz-gone")
    expect(gone).to_be_hidden()
    item = learner.quiz.items[0]
    learner.answer_by_keyboard(item, selection.right_answer(item))
    learner.saved()
    learner.window.save()
    learner.window.restart_kernel()
    learner.window.reload()
    expect(gone).to_be_visible()
    expect(gone).to_contain_text("run this cell again. Your answers and attempts are kept.")
    expect(learner.page.get_by_text("model not found")).to_be_hidden()
    learner.start()
    expect(gone).to_be_hidden()
    expect(learner.question(1).locator("input:checked")).to_have_value(
        str(selection.right_answer(item))
    )


def test_a_second_window_shows_the_same_quiz_and_records_no_second_attempt(
    sit: Sit, open_notebook: OpenNotebook
) -> None:
    learner = sit()
    for item in learner.quiz.items:
        learner.answer_by_keyboard(item, selection.right_answer(item))
    learner.saved()
    learner.window.save()
    other = Learner(open_notebook(learner.window.path), learner.quiz)
    expect(other.question(3).locator("input")).to_have_value(
        f"{selection.right_answer(learner.quiz.items[2]):g}"
    )
    learner.submit.click()
    expect(other.result).to_have_text(re.compile("^Passed: 5 of 5"))
    expect(other.submit).to_be_hidden()
    assert len(learner.attempts()) == 1


def test_no_key_leaves_the_kernel_before_submission(sit: Sit) -> None:
    learner = sit()
    for item in learner.quiz.items:
        learner.answer_by_keyboard(item, selection.right_answer(item))
    learner.saved()

    for place, text in everywhere(learner).items():
        assert not re.search(sample.SECRET, text, re.IGNORECASE), place
        assert "misconception" not in text, place
    assert "Stem" in everywhere(learner)["frames"], "the frames are really read"
    learner.submit.click()
    learner.result.filter(has_text="needed").wait_for()
    assert sample.SECRET in everywhere(learner)["frames"], "the mark is one that would be found"
    assert sample.SECRET in everywhere(learner)["page"]


def everywhere(learner: Learner) -> dict[str, str]:
    """Return all that a learner can look into."""
    return {
        "file": json.dumps(learner.window.save()),
        "page": learner.page.content(),
        "frames": "\n".join(learner.window.frames),
        "folder": "\n".join(
            path.read_text(errors="replace")
            for path in (learner.window.lab.work / learner.window.path).parent.rglob("*")
            if path.is_file()
        ),
    }


def test_a_closed_quiz_is_handed_in_by_keyboard_and_its_key_is_nowhere(sit: Sit) -> None:
    learner = sit(closed=True)
    learner.take(right=4, says="Handed in: your instructor marks it.")
    expect(learner.result).to_be_focused()
    expect(learner.retry).to_be_hidden()
    expect(learner.root.locator(".quiz-verdict")).to_have_count(0)
    expect(learner.root.locator(".quiz-meta")).to_contain_text("Handed in: 1 of 1.")
    for place, text in everywhere(learner).items():
        assert not re.search(sample.SECRET, text, re.IGNORECASE), place
    (attempt,) = learner.attempts()
    bank = learner.quiz.bank
    found = regrade.mark_file(bank, json.dumps(attempt).encode()).best_result
    assert found is not None
    assert found.right == 4
    assert learner.window.errors == []
    assert learner.window.foreign_requests() == []


def test_no_feedback_of_the_real_quiz_is_sent_before_submission(sit: Sit) -> None:
    learner = sit("ch05")
    places = [
        json.dumps(learner.window.save()), learner.page.content(), *learner.window.frames,
    ]  # fmt: skip
    text = re.sub(r"\s+", " ", re.sub(r"<[^>]*>|\\n", " ", "\n".join(places)))
    bank = learner.quiz.bank
    for secret in (*bank.misconceptions, *bank.misconceptions.values()):
        assert secret not in text
    for item in learner.quiz.items:
        for option in getattr(item.variant, "options", []):
            assert rendering.render_plain(option.feedback) not in text


def test_a_kernel_that_does_not_answer_is_told_and_gets_the_answers_later(sit: Sit) -> None:
    learner = sit()
    alarm = learner.root.get_by_role("alert")
    item = learner.quiz.items[0]
    (kernel,) = learner.window.lab.kernel_processes()
    kernel.suspend()
    try:
        learner.answer_by_keyboard(item, selection.right_answer(item))
        expect(alarm).to_contain_text("The kernel does not answer.")
        expect(learner.question(1).locator("input").first).to_be_enabled()
    finally:
        kernel.resume()
    learner.saved()
    expect(alarm).to_have_text("")
    expect(learner.question(1).locator("input:checked")).to_have_value(
        str(selection.right_answer(item))
    )


def test_answers_are_saved_while_another_cell_runs(sit: Sit) -> None:
    learner = sit()
    window = learner.window
    pipe = (window.lab.work / window.path).parent / "go"
    os.mkfifo(pipe)
    learner.page.evaluate(
        "code => { window.jupyterapp.shell.currentWidget.sessionContext.session.kernel"
        ".requestExecute({ code }) }",
        f"open({str(pipe)!r}).read()",
    )
    window.wait_for_kernel("busy")
    item = learner.quiz.items[0]
    learner.answer_by_keyboard(item, selection.right_answer(item))
    pipe.write_text("go on")
    learner.saved()
    window.wait_for_kernel("idle")
    expect(learner.question(1).locator("input:checked")).to_have_value(
        str(selection.right_answer(item))
    )


def test_a_folder_that_takes_no_files_is_told_in_the_quiz(sit: Sit) -> None:
    learner = sit(attempts=Path("/proc"))
    learner.take(right=5)
    expect(learner.root.locator(".quiz-notice")).to_contain_text("Nothing can be saved in /proc")


@pytest.mark.parametrize("theme", ["JupyterLab Light", "JupyterLab Dark"])
def test_text_can_be_read_in_both_themes_and_at_double_size(
    sit: Sit, theme: str, tmp_path: Path
) -> None:
    learner = sit()
    learner.window.theme(theme)
    learner.take(right=3)
    poor = learner.root.evaluate(CONTRAST)
    assert poor == [], "contrast under 4.5 to 1 (WCAG 2.2, 1.4.3)"
    learner.page.set_viewport_size({"width": 640, "height": 450})  # what 200 % leaves of 1280 x 900
    assert learner.root.evaluate(OVERFLOW) == [], "wider than its column at 200 %"
    learner.window.screenshot(tmp_path / "double.png")


CONTRAST = """root => {
    const parse = text => text.match(/[\\d.]+/g).map(Number);
    const over = (top, below) => {
        const alpha = top[3] ?? 1;
        return [0, 1, 2].map(i => top[i] * alpha + below[i] * (1 - alpha));
    };
    const background = element => {
        const layers = [];
        for (let at = element; at; at = at.parentElement) {
            const colour = parse(getComputedStyle(at).backgroundColor);
            layers.push(colour);
            if ((colour[3] ?? 1) === 1) break;
        }
        return layers.reverse().reduce((below, top) => over(top, below), [255, 255, 255]);
    };
    const light = colour => {
        const [r, g, b] = colour.map(c => c / 255)
            .map(c => c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4);
        return 0.2126 * r + 0.7152 * g + 0.0722 * b;
    };
    const poor = [];
    const walker = document.createTreeWalker(root, NodeFilter.SHOW_TEXT);
    while (walker.nextNode()) {
        const element = walker.currentNode.parentElement;
        if (!walker.currentNode.textContent.trim() || !element.checkVisibility()) continue;
        if (element.closest('button[aria-disabled=true], :disabled')) continue;
        const below = background(element);
        const [a, b] = [light(over(parse(getComputedStyle(element).color), below)), light(below)]
            .sort((x, y) => y - x);
        const ratio = (a + 0.05) / (b + 0.05);
        if (ratio < 4.5) poor.push([element.className, walker.currentNode.textContent, ratio]);
    }
    return poor;
}"""

OVERFLOW = """root => {
    const right = root.getBoundingClientRect().right + 1;
    return [...root.querySelectorAll('*')]
        .filter(element => element.checkVisibility() && !element.closest('pre, math'))
        .filter(element => element.getBoundingClientRect().right > right)
        .map(element => element.className || element.tagName);
}"""
