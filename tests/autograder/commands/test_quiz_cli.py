"""`autograder quiz` and the quizzes in `autograder report`: files, sentences, exit codes."""

from __future__ import annotations

import json
import shutil
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import pytest

from autograder import cli
from autograder.assignments.intake import claim_records
from autograder.assignments.intake.claim_records import Claim
from autograder.assignments.intake.handed_files.handed_in import look_through
from autograder.class_report import attention
from autograder.class_report.class_data import ClassData
from autograder.commands import quiz_report
from autograder.gradebook.course_gradebook import Grade
from quizzes.attempts import record, sharing
from quizzes.attempts.record import Attempt, Given
from quizzes.bank import loader, schema, selection
from quizzes.marking import regrade, scoring

BANK = loader.load_bank("ch05")
EXAM = schema.EXAMPLES / "exam.yaml"


Run = Callable[..., tuple[str, str]]


@pytest.fixture
def autograder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Run:
    """The command, in this process and in a folder of its own; returns what it prints."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "200")

    def run(*arguments: str, code: int = 0) -> tuple[str, str]:
        monkeypatch.setattr(sys, "argv", ["autograder", *arguments])
        with pytest.raises(SystemExit) as ended:
            cli.main()
        printed = capsys.readouterr()
        assert ended.value.code == code, printed.out + printed.err
        return printed.out, printed.err

    return run


def hand_in(root: Path, student: str) -> Path:
    """Hand in an attempt in which everything is right; return its file."""
    paper = selection.draw(BANK, student, 1)
    result = scoring.mark_paper(
        paper, {i.concept.id: selection.right_answer(i) for i in paper.items}
    )
    given = {m.item.concept.id: Given(m.item.variant.id, m.answer) for m in result.marks}
    attempt = Attempt("ch05", student, 1, BANK.edition, "2026-01-01T00:00:00+00:00",
                      given, 0.0, 0, False)  # fmt: skip
    folder = root / "submitted" / student / "ch05-quiz"
    folder.mkdir(parents=True)
    file = folder / record.attempts_filename("ch05")
    file.write_text(attempt.to_json() + "\n", encoding="utf-8")
    return file


def test_there_and_back_again(tmp_path: Path, autograder: Run) -> None:
    said, _ = autograder("quiz", "export", "ch05", "--format", "gift")
    assert "Written: ch05.gift (5 of 26 questions are drawn, 5 points)" in said
    assert "There is no ordering: pattern-navigation-2 became a matching" in said
    file = tmp_path / "ch05.gift"
    edited = file.read_text(encoding="utf-8").replace("Three nodes have", "Five nodes have")
    file.write_text(edited, encoding="utf-8")
    said, _ = autograder("quiz", "import", "ch05.gift", "--into", "ch05")
    assert "Written: ch05.yaml (1 new or changed)" in said
    assert "'pattern-camera-3' has changed" in said
    assert "Its pictures are not beside it: copy " in said
    shutil.copytree(BANK.folder / "assets", tmp_path / "assets")
    assert "ch05: 0 to mend" in autograder("quiz", "lint", "ch05.yaml")[0]
    _, error = autograder("quiz", "import", "ch05.gift", "--into", "ch05", code=1)
    assert "ch05.yaml is there already: name the file to write with --to." in error


def test_qti_is_a_zip_file(tmp_path: Path, autograder: Run) -> None:
    said, _ = autograder("quiz", "export", "ch05", "-f", "qti", "--to", "q.zip")
    assert "Written: q.zip (5 of 26 questions are drawn, 5 points)" in said
    assert "text2qti has neither ordering nor matching" in said
    assert "The package asks for 20 attempts, of which the best counts" in said
    assert "imsmanifest.xml" in ZipFile(tmp_path / "q.zip").namelist()


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ("export ch6 -f gift", "There is no quiz 'ch6': there are ch05"),
        ("export ch05 -f xml", "There is no format 'xml': choose one of gift, qti."),
        ("export ch05 -f gift --to no/x.gift", "no/x.gift cannot be written"),
        ("import none.gift --into ch05", "none.gift cannot be read: No such file"),
        ("import . --into ch05", ". cannot be read: Is a directory"),
        ("import bytes.gift --into ch05", "bytes.gift, line 2: this is not UTF-8 text."),
        ("import bad.gift --into ch05", "bad.gift, line 2, question 'q': it is an essay"),
        ("import twice.gift --into ch05", "field options 3 text: the text 'b' stands there twice."),
        ("import fine.gift --into ch05 --to new.yaml", "so call the file ch05.yaml"),
        ("lint broken.yaml", "broken.yaml, line 1: it must be fields with their values, but it is"),
        ("lint ch5", "There is no quiz 'ch5': there are ch05. Did you mean 'ch05'?"),
        ("lint empty.yaml", "empty.yaml is empty"),
        ("lint tab.yaml", "tab.yaml is not valid YAML: line 2: a tab stands where YAML wants"),
        ("lint none.yaml", "There is no bank none.yaml."),
    ],
)
def test_what_is_wrong_is_one_sentence(
    tmp_path: Path, autograder: Run, arguments: str, sentence: str
) -> None:
    (tmp_path / "bytes.gift").write_bytes(b"// fine\n\xff\xfe\n")
    (tmp_path / "bad.gift").write_text("// fine\n::q::Why?{}\n")
    (tmp_path / "fine.gift").write_text("::qos-purpose-1::Why?{=a#f ~b#f}\n")
    (tmp_path / "twice.gift").write_text("::qos-purpose-1::Why?{=a#f ~b#f ~b#f}\n")
    (tmp_path / "broken.yaml").write_text("- quiz: 5\n")
    (tmp_path / "empty.yaml").write_text("")
    (tmp_path / "tab.yaml").write_text("quiz: a\n\ttitle: b\n")
    before = sorted(tmp_path.iterdir())
    _, error = autograder("quiz", *arguments.split(), code=1)
    assert sentence in error
    assert len(error.strip().splitlines()) == 1
    assert sorted(tmp_path.iterdir()) == before, "nothing was written"


def test_a_bank_with_something_to_mend_fails(tmp_path: Path, autograder: Run) -> None:
    text = (BANK.folder / "ch05.yaml").read_text(encoding="utf-8")
    stem = "What is the main purpose of QoS (Quality of Service) profiles in ROS 2?"
    (tmp_path / "ch05.yaml").write_text(text.replace(stem, f"{stem} Who sets them?"))
    shutil.copytree(BANK.folder / "assets", tmp_path / "assets")
    said, _ = autograder("quiz", "lint", "ch05.yaml", code=1)
    assert "item 'qos-purpose-1', field stem: it asks 2 questions" in said


def test_lint_says_all_that_is_wrong_with_several_banks(tmp_path: Path, autograder: Run) -> None:
    broken = EXAM.read_text().replace("objective", "objektive").replace("tolerance: 0.1", "unti: s")
    (tmp_path / "exam.yaml").write_text(broken)
    (tmp_path / "tab.yaml").write_text("quiz: a\n\ttitle: b\n")
    said, error = autograder("quiz", "lint", "exam.yaml", "tab.yaml", "nobody", "ch05", code=1)
    assert "exam.yaml: 7 to mend" in said
    assert said.count("field objektive: there is no such field: did you mean 'objective'?") == 3
    assert said.count("field objective: it is missing") == 3
    assert "line 29, item 'timer-rate-1', field unti: there is no such field: did you mean" in said
    assert "Its questions are read critically once these are mended." in said
    assert "tab.yaml is not valid YAML: line 2: a tab" in error
    assert "There is no quiz 'nobody'" in error
    assert "ch05: 0 to mend" in said, "the others are looked at all the same"


@pytest.fixture
def course(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A course root with a closed quiz of its own; the command is run from a folder inside."""
    banks = tmp_path / "course" / "authoring" / "banks"
    banks.mkdir(parents=True)
    (tmp_path / "course" / "nbgrader_config.py").write_text("")
    shutil.copy(EXAM, banks / "midterm.yaml")
    text = (banks / "midterm.yaml").read_text().replace("quiz: exam", "quiz: midterm")
    (banks / "midterm.yaml").write_text(text)
    (tmp_path / "course" / "work").mkdir()
    monkeypatch.chdir(tmp_path / "course" / "work")
    return tmp_path / "course"


def test_a_courses_own_quiz_is_known_by_its_name(
    autograder: Run, course: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.chdir(course / "work")
    assert "midterm: 0 to mend" in autograder("quiz", "lint", "midterm")[0]
    said, _ = autograder("quiz", "export", "midterm", "-f", "qti")
    assert "Written: midterm.qti.zip (3 of 3 questions are drawn, 3 points)" in said
    said, _ = autograder("quiz", "export", "midterm", "-f", "gift")
    assert "The quiz is closed, but the file has its keys" in said
    text = Path("midterm.gift").read_text().replace("Any, whatever", "Each, whatever")
    Path("midterm.gift").write_text(text)
    said, _ = autograder("quiz", "import", "midterm.gift", "--into", "midterm")
    assert "Written: midterm.yaml (1 new or changed)" in said
    assert "'matching-rule-1' has changed." in said
    assert "midterm.yaml: 0 to mend" in autograder("quiz", "lint", "midterm.yaml")[0].replace(
        "midterm: 0", "midterm.yaml: 0"
    )
    _, error = autograder("quiz", "lint", "midtrem", code=1)
    assert "There is no quiz 'midtrem': there are ch05, midterm. Did you mean 'midterm'?" in error
    monkeypatch.chdir(tmp_path)
    said, _ = autograder("quiz", "lint", "midterm", "--root", str(course))
    assert "midterm: 0 to mend" in said


def test_the_format_is_printed_for_people_and_for_editors(autograder: Run) -> None:
    said, _ = autograder("quiz", "schema")
    assert said == schema.as_markdown()
    said, _ = autograder("quiz", "schema", "--json")
    assert json.loads(said) == schema.json_schema()


def test_a_classs_quiz_is_analysed(tmp_path: Path) -> None:
    for student in ("ann", "ben"):
        hand_in(tmp_path, student)
    (tmp_path / "submitted" / "cem" / "ch05-quiz").mkdir(parents=True)
    [report] = quiz_report.of_assignment(tmp_path, "ch05-quiz")
    data = json.loads(json.dumps(report.as_data()))
    assert (data["quiz"], data["learners"], data["passed"]) == ("ch05", 2, 2)
    assert data["notes"] == ["cem has handed in no quiz-ch05.attempts.jsonl."]
    assert {item["difficulty"] for item in data["items"]} == {1.0, None}
    folder = tmp_path / "reports" / "ch05-quiz"
    assert sorted(path.name for path in folder.iterdir()) == [
        "quiz-ch05-items.csv",
        "quiz-ch05-misconceptions.csv",
        "quiz-ch05-report.html",
    ]
    items, beliefs, _ = report.as_tables()
    dealt = {i.variant.id for s in ("ann", "ben") for i in selection.draw(BANK, s, 1).items}
    assert items.row_count == len(BANK.concepts) + len(dealt)
    assert beliefs.row_count == 0


def test_attempts_that_the_gradebook_takes_are_in_the_report_whatever_their_name(
    tmp_path: Path,
) -> None:
    places = {who: hand_in(tmp_path, who) for who in ("ann", "ben", "cem", "dee", "eli", "fay")}
    places["ann"].rename(places["ann"].with_name("my attempts.jsonl"))
    with ZipFile(places["ben"].with_name("hand-in.zip"), "w") as archive:
        archive.write(places["ben"], f"work/{places['ben'].name}")
    places["ben"].unlink()
    places["cem"].rename(places["cem"].with_name("saved.bin"))
    folder = places["cem"].parent
    state = claim_records.digest_state(
        folder, look_through(folder), places["cem"].name, "saved.bin"
    )
    claim = Claim("saved.bin", state)
    claim_records.keep_claim(tmp_path, "ch05-quiz", "cem", "quiz-ch05", claim)
    places["dee"].write_bytes(places["ann"].with_name("my attempts.jsonl").read_bytes())
    places["eli"].rename(places["eli"].with_name("attempts.docx"))
    places["eli"].with_name("attempts.docx").write_bytes(b"PK")
    places["fay"].unlink()
    places["fay"].symlink_to(places["dee"])
    [report] = quiz_report.of_assignment(tmp_path, "ch05-quiz")
    assert report.analysis.learners == 4
    notes = {note.split(":")[0]: note for note in report.analysis.notes}
    assert "login of 'ann'" in notes["dee"]
    assert "there is 'attempts.docx'" in notes["eli"]
    assert not any("handed in no" in note for note in notes)
    assert any("of fay cannot be read" in note for note in notes)
    assert report.shared == (("ann", "dee"),)


def test_an_assignment_without_a_quiz_has_no_report(tmp_path: Path) -> None:
    (tmp_path / "submitted" / "ann" / "ch05").mkdir(parents=True)
    assert quiz_report.of_assignment(tmp_path, "ch05") == []
    assert not (tmp_path / "reports").exists()


def test_who_hands_in_the_same_attempts_is_named_and_keeps_the_points(tmp_path: Path) -> None:
    ann = hand_in(tmp_path, "ann")
    for student in ("cem", "dora"):  # a friend's whole file, one of them under another name
        folder = tmp_path / "submitted" / student / "ch05-quiz"
        folder.mkdir(parents=True)
        (folder / ann.name).write_bytes(ann.read_bytes())
    (folder / ann.name).rename(folder / "my attempts.jsonl")
    hand_in(tmp_path, "ben")  # as good, and his own
    [report] = quiz_report.of_assignment(tmp_path, "ch05-quiz")
    data = json.loads(json.dumps(report.as_data()))
    assert data["same_attempts"] == [["ann", "cem", "dora"]]
    assert "cannot know who answered" in data["cannot_know"]
    assert data["notes"][0] == "The same attempts were handed in by ann, cem, dora."
    page = (tmp_path / "reports" / "ch05-quiz" / "quiz-ch05-report.html").read_text()
    assert "handed in by ann, cem, dora" in page
    assert "What a quiz cannot know" in page
    cell = "quiz-ch05"
    grades = [
        Grade(name, 5.0, 5.0, False, {"quiz": {cell: 5.0}})
        for name in ("ann", "ben", "cem", "dora")
    ]
    [need] = attention.people_needed(ClassData(tmp_path, "ch05-quiz", 5.0, tuple(grades)))
    assert need.students == ("ann", "cem", "dora")
    assert need.urgent
    assert "the quiz ch05 were handed in by several" in need.why


def altered(line: dict[str, Any], how: str) -> list[dict[str, Any]]:
    """Return the attempts of a copy, made to look like others."""
    names = [*line["answers"]]
    answers = {name: dict(given) for name, given in line["answers"].items()}
    match how:
        case "the other way round":
            answers = {name: answers[name] for name in reversed(names)}
        case "one answer":
            answers[names[0]]["answer"] = "a" if answers[names[0]]["answer"] != "a" else "b"
        case "spelling":
            for given in answers.values():
                if isinstance(given["answer"], str):
                    given["answer"] = f" {', '.join(given['answer']).upper()}"
        case "score":
            line = {**line, "score": 1.0, "right": 1, "passed": True, "edition": "mine"}
        case "among others":
            return [{**line, "attempt": 2, "submitted": "2026-01-02T00:00:00+00:00"}, line]
    return [{**line, "answers": answers}]


@pytest.mark.parametrize(
    "how", ["the other way round", "one answer", "spelling", "score", "among others"]
)
def test_a_copy_that_was_made_to_look_like_another_is_named(tmp_path: Path, how: str) -> None:
    file = hand_in(tmp_path, "ann")
    lines = altered(json.loads(file.read_bytes()), how)
    copy = "".join(f"{json.dumps(line)}\n" for line in lines).encode()
    assert copy != file.read_bytes()
    contents = {"ann": file.read_bytes(), "ben": copy}
    assert sharing.same_attempts("ch05", contents) == [("ann", "ben")]


def test_what_was_added_to_an_attempt_or_given_another_login_earns_nothing(tmp_path: Path) -> None:
    line = json.loads(hand_in(tmp_path, "ann").read_bytes())
    extra = {**line["answers"], "more": {"variant": "more", "answer": "a"}}
    for changes in ({"answers": extra}, {"student": "ben"}):
        marked = regrade.mark_file(BANK, json.dumps({**line, **changes}).encode())
        assert marked.best_result is None or marked.best_result.score < 1, changes
        assert "answers questions that were not asked in it" in "".join(marked.problems)


def test_equal_answers_at_another_time_are_nobodys_copy(tmp_path: Path) -> None:
    content = hand_in(tmp_path, "ann").read_bytes()
    line = json.loads(content.splitlines()[-1])
    later = json.dumps({**line, "submitted": "2026-11-28T12:00:01+00:00"}).encode()
    assert sharing.same_attempts("ch05", {"ann": content, "ben": later}) == []
    assert sharing.same_attempts("other", {"ann": content, "ben": content}) == []
    assert sharing.same_attempts("ch05", {"ann": content, "ben": b"{}\n" + content}) == [
        ("ann", "ben")
    ]
