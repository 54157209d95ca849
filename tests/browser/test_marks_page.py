"""The page on which one question is marked for a whole class, opened from its file."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest
from playwright.sync_api import Browser, expect

from autograder.assignments.questions import GradedQuestion
from autograder.gradebook.written_answers import answers_page
from autograder.gradebook.written_answers.answers import COLUMNS, Answer, Answers

pytestmark = pytest.mark.xdist_group("browser: grading")

EVIL = '</script><script>document.title = "run"</script>'


def test_marks_are_filled_in_kept_and_saved(browser: Browser, tmp_path: Path) -> None:
    question = GradedQuestion("qos-design", "qos-loss", "A lost frame", True, 1.0, model="Nobody.")
    answers = (
        Answer("ann", "Ann", f"=1+1 {EVIL}", None, "", True, "s1"),
        Answer("-dan", "Dan", 'Two\nlines, "quoted"', None, "", True, "s2"),
        Answer("cy", "Cy", "Third", 1.0, "Well done", False, "s3"),
    )
    file = tmp_path / "marks.html"
    file.write_text(
        answers_page.render_page(Answers("ch05", question, answers), "marks.csv"), "utf-8"
    )
    context = browser.new_context(accept_downloads=True)
    page = context.new_page()
    errors: list[str] = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.on("console", lambda message: errors.append(message.text))
    page.goto(file.as_uri())
    expect(page).to_have_title("A lost frame: 3 answers")
    expect(page.get_by_role("status")).to_have_text("1 of 3 marked")
    ann, dan, _ = page.get_by_role("article").all()
    expect(ann).to_contain_text(EVIL)
    ann.get_by_role("button", name="0.5").click()
    ann.get_by_label("Comment").fill('=So "so"')
    dan.get_by_label("Points").fill("2")
    expect(page.get_by_role("status")).to_have_text("2 of 3 marked")
    page.reload()
    expect(ann.get_by_label("Points")).to_have_value("0.5")
    dan.get_by_label("Points").fill("0")
    with page.expect_download() as download:
        page.get_by_role("button", name="Save the marks").click()
    assert download.value.suggested_filename == "marks.csv"
    with Path(download.value.path()).open(encoding="utf-8", newline="") as saved:
        rows = list(csv.DictReader(saved))
    assert tuple(rows[0]) == COLUMNS
    assert [(r["student"], r["points"], r["comment"], r["state"]) for r in rows] == [
        ("ann", "0.5", "'=So \"so\"", "s1"),
        ("'-dan", "0", "", "s2"),
        ("cy", "1", "Well done", "s3"),
    ]  # fmt: skip
    assert rows[1]["answer"] == 'Two\nlines, "quoted"'
    assert not errors
    context.close()
