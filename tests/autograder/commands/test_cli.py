"""The `autograder` command as people and scripts meet it: words, exit codes, JSON."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from pathlib import Path

import pytest

from autograder.sandbox import abilities
from tests.autograder.conftest import Course
from tests.machine import needs_isolation, needs_own_mounts, needs_sandbox


def autograder(
    *arguments: str, cwd: Path, code: int = 0, before: str = "", timeout: float = 170
) -> subprocess.CompletedProcess[str]:
    """Run the command; ``before`` is shell that prepares a private mount namespace for it."""
    executable = shutil.which("autograder")
    assert executable is not None
    command = [executable, *arguments]
    if before:
        command = ["unshare", "-rm", "bash", "-c", f'{before}; exec "$@"', "bash", *command]
    env = {**os.environ, "COLUMNS": "200"}
    result = subprocess.run(
        command, cwd=cwd, env=env, capture_output=True, text=True, timeout=timeout, check=False
    )
    assert result.returncode == code, result.stdout + result.stderr
    assert "Traceback" not in result.stdout + result.stderr
    return result


def test_the_demo_ends_with_grades(tmp_path: Path) -> None:
    result = autograder("demo", "--dir", "here", "--json", cwd=tmp_path)
    demo = json.loads(result.stdout)
    assert demo["as_expected"] is True
    scores = {row["student"]: row["grade"]["score"] for row in demo["rows"]}
    assert len(scores) == 12
    full = 15 if abilities().loss else 13  # what lost packets show is then left to a person
    assert scores["right-chapter"] == scores["right-two-sides"] == full
    assert scores["broken-file"] == scores["broken-syntax"] == 0
    assert 0 == scores["wrong-stub"] < scores["wrong-imu-endless"] < full
    root = tmp_path / "here"
    assert len((root / "grades.csv").read_text().splitlines()) == 1 + len(scores)
    assert len(list((root / "feedback").glob("*/ch05/qos-design.html"))) == len(scores)
    waiting = {row["student"] for row in demo["rows"] if row["grade"]["needs_manual_grade"]}
    assert "right-chapter" in waiting, "the written explanation waits for a person"


@needs_sandbox
def test_the_name_of_a_folder_may_be_no_text(
    course: Course, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PYTHONIOENCODING", "utf-8:strict")
    course.folder(os.fsdecode(b"M\xfcller"))
    course.folder("nobody")
    table = autograder("grade", "ch05", cwd=course.root, code=1).stdout
    assert "M\\udcfcller" in table
    data = json.loads(autograder("grade", "ch05", "--json", cwd=course.root, code=1).stdout)
    assert "rename the folder" in data["problems"][os.fsdecode(b"M\xfcller")]
    assert [grade["student"] for grade in data["grades"]] == ["nobody"]
    autograder("report", "ch05", cwd=course.root)


@needs_sandbox
@pytest.mark.timeout(900)
def test_the_demo_of_all_exercises(tmp_path: Path) -> None:
    result = autograder("demo", "--all", "--dir", "here", "--json", cwd=tmp_path, timeout=850)
    demo = json.loads(result.stdout)
    assert demo["as_expected"] is True, demo["rows"]
    scores = {row["student"]: row["grade"]["score"] for row in demo["rows"]}
    assert scores["by-the-chapter"] == scores["other-designs"] == 75
    assert scores["not-python"] == scores["damaged"] == 0
    assert 0 == scores["as-handed-out"] < scores["first-two-only"] < scores["one-mistake-each"] < 75
    assert scores["first-two-only"] == 30
    assert {row["grade"]["max_score"] for row in demo["rows"]} == {100}
    pages = [path.name for path in (tmp_path / "here/feedback").glob("*/ch05/*.html")]
    assert pages.count("index.html") == len(scores)
    assert len(pages) == (5 + 1) * len(scores)


def test_the_demo_leaves_other_peoples_files_alone(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("ten years of work")
    result = autograder("demo", "--dir", str(tmp_path), cwd=tmp_path, code=1)
    assert "not an earlier demo" in result.stderr
    assert (tmp_path / "thesis.tex").read_text() == "ten years of work"


@needs_own_mounts
@pytest.mark.parametrize("size", ["300k", "1m"])
def test_a_full_disk_is_one_sentence(tmp_path: Path, size: str) -> None:
    mount = f"mount -t tmpfs -o size={size} none {tmp_path}"
    result = autograder("demo", "--dir", str(tmp_path / "d"), cwd=tmp_path, code=1, before=mount)
    assert "make room" in result.stderr
    assert len(result.stderr.strip().splitlines()) == 1


@needs_own_mounts
def test_a_read_only_folder_is_one_sentence(tmp_path: Path) -> None:
    mount = f"mount -t tmpfs -o ro none {tmp_path}"
    result = autograder("demo", "--dir", str(tmp_path / "d"), cwd=tmp_path, code=1, before=mount)
    assert "Read-only file system" in result.stderr


def test_an_unknown_assignment_or_exam_names_those_there_are(course: Course) -> None:
    result = autograder("grade", "ch99", "--root", str(course.root), cwd=course.root, code=1)
    assert "There is no assignment 'ch99'" in result.stderr
    assert "ch05" in result.stderr
    result = autograder("release", "ch99", "--root", str(course.root), cwd=course.root, code=1)
    assert "ch05" in result.stderr
    result = autograder("corpus", "--exercise", "qso", cwd=course.root, code=1)
    assert "Did you mean 'qos'?" in result.stderr


@needs_isolation
def test_grade_and_report_speak_json(course: Course) -> None:
    course.submit("s1", "not a notebook")
    root = ("--root", str(course.root))
    result = autograder("grade", "ch05", *root, "--json", cwd=course.root)
    graded = json.loads(result.stdout)
    assert graded["grades"][0]["student"] == "s1"
    assert "not valid JSON" in graded["problems"]["s1"]
    report = json.loads(autograder("report", "ch05", *root, "--json", cwd=course.root).stdout)
    assert report["grades"] == graded["grades"]
    assert "s1" in autograder("report", "ch05", *root, cwd=course.root).stdout


def test_the_built_notebooks_are_in_step(tmp_path: Path) -> None:
    autograder("build", "--check", cwd=tmp_path)


def test_help_lists_the_commands(tmp_path: Path) -> None:
    text = autograder("--help", cwd=tmp_path).stdout
    for command in ("build", "release", "grade", "corpus", "report", "demo"):
        assert command in text
