"""The journal of a working copy: what it remembers, and what damage to it costs."""

from __future__ import annotations

import json
import multiprocessing
import threading
from pathlib import Path

import pytest
from filelock import FileLock
from IPython.core.interactiveshell import ExecutionInfo, ExecutionResult

from course.workspace.journal import journal_file
from course.workspace.journal.journal_file import (
    FILE,
    MANIFEST,
    Journal,
    JournalError,
    journal_here,
)
from course.workspace.journal.notes import CellNotes


@pytest.fixture
def journal(tmp_path: Path) -> Journal:
    (tmp_path / MANIFEST).write_text("{}")
    return Journal(tmp_path)


def ran(cell: str, error: Exception | None = None) -> ExecutionResult:
    result = ExecutionResult(ExecutionInfo("1", True, True, True, cell))
    result.error_in_exec = error
    return result


def test_cells_and_checks_are_remembered(journal: Journal) -> None:
    journal.record_run("a")
    journal.record_checks("qos", 9.0, 10.0, ["starts", "flows"], ["newest"])
    journal.record_checks("qos", 8.0, 10.0, ["starts"], ["flows", "newest"])
    journal.record_run("b")
    entries = Journal(journal.folder).read()
    assert list(entries.cells) == ["a", "b"]
    found = entries.checks["qos"]
    assert (found.score, found.best, found.max_score) == (8.0, 9.0, 10.0)
    assert (found.passed, found.open) == (("starts", "flows"), ("newest",)), "those of the best"
    assert entries.notice == ""


def test_the_best_of_an_exam_with_other_points_does_not_count(journal: Journal) -> None:
    journal.record_checks("qos", 9.0, 10.0, [], [])
    journal.record_checks("qos", 3.0, 5.0, [], [])
    assert journal.read().checks["qos"].best == 3.0


def test_a_journal_is_bounded(journal: Journal, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(journal_file, "MAX_CELLS", 3)
    for cell in ("a", "b", "c", "a", "d"):
        journal.record_run(cell)
    assert list(journal.read().cells) == ["c", "a", "d"]
    journal.record_checks("qos", 1.0, 1.0, ["x" * 1000] * 1000, [])
    assert journal.path.stat().st_size < 50_000


GOOD = {
    "when": "2026-01-01T00:00:00+00:00", "score": 1, "max_score": 2, "best": 1,
    "passed": [], "open": [],
}  # fmt: skip


@pytest.mark.parametrize(
    "content",
    [
        b"", b"{", b"[]", b"3", b"\xff\xfe", b"[" * 100_000, b'{"version": 2}',
        json.dumps({"version": 1, "cells": [], "checks": {}}).encode(),
        json.dumps({"version": 1, "cells": {"a": "yesterday"}, "checks": {}}).encode(),
        json.dumps({"version": 1, "cells": {"a": "2026-01-01T00:00:00"}, "checks": {}}).encode(),
        *(
            json.dumps({"version": 1, "cells": {}, "checks": {"qos": {**GOOD, **bad}}}).encode()
            for bad in (
                {"score": 3}, {"score": -1}, {"score": None}, {"best": float("nan")},
                {"max_score": float("inf")}, {"open": [3]}, {"when": 5}, {"passed": None},
            )
        ),
    ],
)  # fmt: skip
def test_a_damaged_journal_is_kept_aside_and_begins_anew(journal: Journal, content: bytes) -> None:
    journal.path.write_bytes(content)
    entries = journal.read()
    assert (entries.cells, entries.checks) == ({}, {})
    assert f"kept as {FILE}.corrupt-1" in entries.notice
    assert (journal.folder / f"{FILE}.corrupt-1").read_bytes() == content
    journal.record_run("a")
    assert list(journal.read().cells) == ["a"]
    journal.path.write_bytes(content)
    journal.record_run("b")  # a damaged one does not stop a note, either
    assert (journal.folder / f"{FILE}.corrupt-2").read_bytes() == content


def test_a_journal_that_is_too_long_is_not_read(journal: Journal) -> None:
    journal.path.write_bytes(b" " * (journal_file.MAX_FILE_BYTES + 1))
    assert "damaged" in journal.read().notice


def test_a_folder_in_the_place_of_the_journal_is_said(journal: Journal) -> None:
    journal.path.mkdir()
    assert "cannot be read (it is not a file)" in journal.read().notice
    with pytest.raises(JournalError, match=r"Your progress cannot be noted in .*itself is not"):
        journal.record_run("a")


def test_a_place_that_takes_no_files_is_said() -> None:
    with pytest.raises(JournalError, match="cannot be noted in /proc"):
        Journal(Path("/proc")).record_run("a")


def test_a_program_that_holds_the_journal_is_said(
    journal: Journal, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(journal_file, "LOCK_TIMEOUT_S", 0.01)
    with (
        FileLock(journal.folder / f".{FILE}.lock"),
        pytest.raises(JournalError, match="another program has held"),
    ):
        journal.record_run("a")


def _note(folder: Path, name: str, count: int) -> None:
    for number in range(count):
        Journal(folder).record_run(f"{name}-{number}")


def test_notebooks_that_note_at_once_lose_nothing(journal: Journal) -> None:
    context = multiprocessing.get_context("spawn")
    others = [context.Process(target=_note, args=(journal.folder, n, 20)) for n in "ab"]
    threads = [threading.Thread(target=_note, args=(journal.folder, n, 20)) for n in "cd"]
    for worker in (*others, *threads):
        worker.start()
    for worker in (*others, *threads):
        worker.join(120)
    assert len(journal.read().cells) == 80


def test_a_kernel_notes_a_cell_once_and_only_if_it_ran_well(
    journal: Journal, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = journal.folder / "ch05"
    folder.mkdir()
    monkeypatch.chdir(folder)
    notes = CellNotes()
    assert notes.note_cell(ran("failed", ValueError())) == ""
    assert notes.note_cell(ran("a")) == ""
    first = journal.path.stat().st_mtime_ns
    assert notes.note_cell(ran("a")) == ""
    assert notes.note_cell(None) == ""
    assert notes.note_cell(ExecutionResult(None)) == ""
    assert journal.path.stat().st_mtime_ns == first
    assert list(journal.read().cells) == ["a"]


def test_a_note_that_cannot_be_made_is_said_once(
    journal: Journal, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(journal.folder)
    journal.path.mkdir()
    notes = CellNotes()
    assert "cannot be noted" in notes.note_cell(ran("a"))
    assert notes.note_cell(ran("b")) == ""


def test_outside_of_a_working_copy_nothing_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert journal_here() is None
    assert CellNotes().note_cell(ran("a")) == ""
    assert list(tmp_path.iterdir()) == []
