"""A learner in front of the quiz, who uses nothing but the keyboard."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import nbformat.v4
from playwright.sync_api import Locator

from quizzes.attempts.quiz_answers import Answer
from quizzes.bank import selection
from quizzes.bank.selection import PaperItem
from quizzes.notebook.quiz import Quiz

from .notebook_page import NotebookPage

STUDENT = "ada"


def write_notebook(
    folder: Path, banks: Path | None, quiz: str, attempts: Path | None = None
) -> Path:
    """Write a notebook with a quiz between two other cells; return its file."""
    where = f", banks=Path({str(banks)!r})" if banks else ""
    where += f", folder=Path({str(attempts)!r})" if attempts else ""
    source = (
        "from pathlib import Path\nimport quizzes\n"
        f"quiz = quizzes.load({quiz!r}, student={STUDENT!r}{where})\nquiz.show()"
    )
    kernel = {"name": "python3", "display_name": "Python 3", "language": "python"}
    notebook = nbformat.v4.new_notebook(  # type: ignore[no-untyped-call]
        cells=[
            nbformat.v4.new_markdown_cell("Before."),  # type: ignore[no-untyped-call]
            nbformat.v4.new_code_cell(source),  # type: ignore[no-untyped-call]
            nbformat.v4.new_code_cell("print('quiz', quiz)"),  # type: ignore[no-untyped-call]
        ],
        metadata={"kernelspec": kernel},
    )
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "quiz.ipynb"
    path.write_text(json.dumps(notebook))
    return path


class Learner:
    """Takes the quiz that a page shows; ``quiz`` is the same quiz here, to know the key."""

    def __init__(self, window: NotebookPage, quiz: Quiz) -> None:
        self.window = window
        self.page = window.page
        self.quiz = quiz
        self.root = self.page.locator(".quiz")

    def start(self) -> None:
        """Run the notebook and put the focus on the quiz's title."""
        self.window.run_all()
        self.question(1).wait_for()
        self.root.locator(".quiz-title").focus()

    def question(self, number: int) -> Locator:
        return self.root.locator("fieldset").nth(number - 1)

    @property
    def submit(self) -> Locator:
        return self.root.get_by_role("button", name="Submit answers")

    @property
    def retry(self) -> Locator:
        return self.root.get_by_role("button", name="Try another quiz")

    @property
    def result(self) -> Locator:
        return self.root.locator(".quiz-result")

    def tab_to(self, target: Locator, *, most: int = 80) -> None:
        """Press Tab until ``target`` has the focus."""
        for _ in range(most):
            if target.evaluate("element => element === document.activeElement"):
                return
            self.page.keyboard.press("Tab")
        raise AssertionError(f"Tab never came to {target}")

    def tab_into(self, number: int, selector: str) -> Locator:
        """Press Tab until something in a question that matches ``selector`` has the focus."""
        for _ in range(80):
            found = self.question(number).locator(f"{selector}:focus")
            if found.count():
                return found
            self.page.keyboard.press("Tab")
        raise AssertionError(f"Tab never came to {selector} of question {number}")

    def answer_by_keyboard(self, item: PaperItem, answer: Answer) -> None:
        kind = item.variant.kind
        {
            "single": self._choose, "predict": self._choose, "multiple": self._tick,
            "numeric": self._type, "ordering": self._order, "matching": self._match,
        }[kind](item, str(answer))  # fmt: skip

    def _choose(self, item: PaperItem, letter: str) -> None:
        focused = self.tab_into(item.number, "input[type=radio]")
        if not focused.is_checked():
            self.page.keyboard.press("Space")
        for _ in item.letters:
            if focused.get_attribute("value") == letter:
                return
            self.page.keyboard.press("ArrowDown")
        raise AssertionError(f"no arrow leads to option {letter}")

    def _tick(self, item: PaperItem, letters: str) -> None:
        for letter in letters:
            self.tab_to(self.question(item.number).locator(f'input[value="{letter}"]'))
            self.page.keyboard.press("Space")

    def _type(self, item: PaperItem, number: str) -> None:
        self.tab_into(item.number, "input[type=number]")
        self.page.keyboard.press("Control+A")
        self.page.keyboard.type(number)

    def _order(self, item: PaperItem, letters: str) -> None:
        """Sort by pressing each thing up to its place, from the first on."""
        shown = list(item.letters)
        for place, letter in enumerate(letters):
            rows = self.question(item.number).locator("li")
            for step in range(shown.index(letter) - place):
                up = rows.nth(shown.index(letter) - step).locator("button").first
                if step == 0:
                    self.shift_tab_to(up)
                assert up.evaluate("element => element === document.activeElement")
                self.page.keyboard.press("Enter")
            shown.remove(letter)
            shown.insert(place, letter)

    def shift_tab_to(self, target: Locator) -> None:
        """Go to ``target``, forwards or backwards."""
        behind = target.evaluate(
            "element => Boolean(document.activeElement.compareDocumentPosition(element) & 2)"
        )
        for _ in range(80):
            if target.evaluate("element => element === document.activeElement"):
                return
            self.page.keyboard.press("Shift+Tab" if behind else "Tab")
        raise AssertionError(f"Tab never came to {target}")

    def _match(self, item: PaperItem, letters: str) -> None:
        for index, letter in enumerate(letters):
            select = self.question(item.number).locator("select").nth(index)
            self.tab_to(select)
            for _ in range(len(item.letters) + 1):
                if select.input_value() == letter:
                    break
                self.page.keyboard.press("ArrowDown")
            assert select.input_value() == letter

    def take(self, *, right: int, says: str = "needed") -> None:
        """Answer all questions by keyboard, the first ``right`` of them rightly, and submit."""
        for item in self.quiz.items:
            key = selection.right_answer(item)
            answer = key if item.number <= right else WRONG[item.variant.kind](item, key)
            self.answer_by_keyboard(item, answer)
        self.tab_to(self.submit)
        self.page.keyboard.press("Enter")
        self.result.filter(has_text=says).wait_for()

    def saved(self) -> None:
        """Wait until the kernel has all answers."""
        self.root.locator(".quiz-saved", has_text="Answers saved.").wait_for()

    def attempts(self) -> list[dict[str, Any]]:
        """Return the attempts in the file beside the notebook."""
        path = self.window.lab.work / Path(self.window.path).parent
        file = path / f"quiz-{self.quiz.bank.quiz}.attempts.jsonl"
        return [json.loads(line) for line in file.read_text().splitlines()] if file.exists() else []


def _other_letter(item: PaperItem, key: Answer) -> Answer:
    return next(letter for letter in item.letters if letter not in str(key))


def _rotated(_item: PaperItem, key: Answer) -> Answer:
    return str(key)[1:] + str(key)[0]


WRONG = {
    "single": _other_letter, "predict": _other_letter, "multiple": _other_letter,
    "numeric": lambda _item, key: float(key) + 50, "ordering": _rotated, "matching": _rotated,
}  # fmt: skip
