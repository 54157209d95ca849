"""The attempts of a quiz on disk: one line of JSON each, in a file beside the student's work.

A line is added whole and synced, under a lock, so that neither a crash nor a second tab can spoil
or lose one. What cannot be read is kept aside, never thrown away. Scores in the file are for
people to read; a program that needs a score marks the answers again (see
`quizzes.marking.regrade`).
"""

from __future__ import annotations

import errno
import json
import os
import shutil
import stat
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from filelock import FileLock, Timeout

from quizzes.attempts.record import MAX_FILE_BYTES, Attempt, attempts_filename, parse_attempts
from quizzes.errors import AttemptsError, UnwritableError

LOCK_TIMEOUT_S = 10.0
"""Seconds to wait for another tab that is writing; it needs milliseconds."""


def _open_plain(path: str, flags: int) -> int:
    """Open a file, but nothing that never ends, such as a pipe or a device."""
    handle = os.open(path, flags | os.O_NONBLOCK)
    if stat.S_ISREG(os.fstat(handle).st_mode):
        return handle
    os.close(handle)
    raise OSError(errno.EINVAL, "it is not a file", path)


class AttemptsFile:
    """The attempts and the unsubmitted answers of one quiz in one folder."""

    def __init__(self, folder: Path, quiz: str) -> None:
        """Use ``folder``; nothing is written before there is something to keep."""
        self.path = folder / attempts_filename(quiz)
        self._quiz = quiz
        self._draft = folder / f".quiz-{quiz}.draft.json"
        self._lock = folder / f".quiz-{quiz}.lock"

    def read(self) -> tuple[list[Attempt], str]:
        """Return the attempts, and a sentence if something about the file should be known.

        A damaged file is kept aside as ``NAME.corrupt-N``; its sound lines stay in use.
        """
        try:
            attempts, damaged = parse_attempts(self._read_content())
        except OSError as error:
            return [], (
                f"Your attempts in {self.path} cannot be read ({error.strerror or error}), so "
                "this quiz begins anew: make the file readable and run the cell again."
            )
        if not damaged:
            return attempts, ""
        try:
            with self._hold_lock():
                return self._mend_file()
        except OSError as error:
            return attempts, str(self._unwritable_error(error))
        except AttemptsError as error:
            return attempts, str(error)

    def append(self, attempt: Attempt) -> None:
        """Add an attempt for good: it is on the disk when this returns, and its draft is gone.

        Raises:
            UnwritableError: the folder cannot be written.
            AttemptsError: another tab has submitted this attempt already, or is writing for long.
        """
        try:
            with self._hold_lock():
                content = self._read_content()
                known, damaged = parse_attempts(content)
                if damaged:
                    known, _ = self._mend_file()
                    content = b""
                if any((a.student, a.attempt) == (attempt.student, attempt.attempt) for a in known):
                    raise self._submitted_error(attempt.attempt)
                # The last line may have lost its end, to an editor or to a copy that was cut short.
                ended = content.endswith(b"\n") or not content
                self._append_line(f"{'' if ended else chr(10)}{attempt.to_json()}\n".encode())
                if self.read_draft().get("student") == attempt.student:
                    self._draft.unlink(missing_ok=True)
        except OSError as error:
            raise self._unwritable_error(error) from None

    def save_draft(
        self, student: str, attempt: int, edition: str, answers: Mapping[str, Any]
    ) -> dict[str, Any]:
        """Keep answers that are not submitted yet, beside those kept of the same attempt.

        Another window may have answered other questions: the answers of both are returned.

        Raises:
            UnwritableError: the folder cannot be written.
            AttemptsError: another window has submitted this attempt already, or is writing for
                long.
        """
        whose = {"quiz": self._quiz, "student": student, "attempt": attempt, "edition": edition}
        temporary = self._draft.with_name(f"{self._draft.name}.{os.getpid()}")
        try:
            with self._hold_lock():
                known, _ = parse_attempts(self._read_content())
                if any(a.student == student and a.attempt >= attempt for a in known):
                    raise self._submitted_error(attempt)
                kept = self.read_draft()
                same = {name: kept.get(name) for name in whose} == whose
                before = kept.get("answers") if same else {}
                merged = {**(before if isinstance(before, dict) else {}), **answers}
                try:
                    draft = json.dumps({**whose, "answers": merged}, ensure_ascii=False)
                    temporary.write_text(draft, encoding="utf-8")
                    temporary.replace(self._draft)
                finally:
                    temporary.unlink(missing_ok=True)
        except OSError as error:
            raise self._unwritable_error(error) from None
        return merged

    def read_draft(self) -> dict[str, Any]:
        """Return the unsubmitted answers; empty if there are none that can be read."""
        try:
            draft = json.loads(self._draft.read_bytes().decode("utf-8"))
        except (OSError, ValueError, RecursionError):
            return {}
        return draft if isinstance(draft, dict) else {}

    def _read_content(self) -> bytes:
        try:
            with open(self.path, "rb", opener=_open_plain) as file:
                return file.read(MAX_FILE_BYTES + 1)
        except FileNotFoundError:
            return b""

    def _append_line(self, line: bytes) -> None:
        """Append a line in one write; a line that a full disk cut short is taken back."""
        before = self.path.stat().st_size if self.path.exists() else 0
        handle = os.open(self.path, os.O_WRONLY | os.O_APPEND | os.O_CREAT | os.O_CLOEXEC, 0o644)
        try:
            try:
                written = os.write(handle, line)
                if written < len(line):
                    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
                os.fsync(handle)
            except OSError:
                with suppress(OSError):
                    os.ftruncate(handle, before)
                raise
        finally:
            os.close(handle)
        self._sync_folder()

    def _sync_folder(self) -> None:
        with suppress(OSError):  # some network file systems cannot, and need not
            handle = os.open(self.path.parent, os.O_RDONLY | os.O_DIRECTORY)
            try:
                os.fsync(handle)
            finally:
                os.close(handle)

    def _mend_file(self) -> tuple[list[Attempt], str]:
        """Keep a damaged file aside and its sound lines in use; call it with the lock held."""
        attempts, damaged = parse_attempts(self._read_content())
        if not damaged:
            return attempts, ""  # another tab was faster
        aside = self._free_name()
        temporary = self.path.with_name(f"{self.path.name}.{os.getpid()}")
        with temporary.open("w", encoding="utf-8") as file:
            file.writelines(f"{attempt.to_json()}\n" for attempt in attempts)
            file.flush()
            os.fsync(file.fileno())
        shutil.copyfile(self.path, aside)  # and not renamed: a crash here leaves both
        temporary.replace(self.path)
        self._sync_folder()
        noun, verb = ("attempt", "is") if len(attempts) == 1 else ("attempts", "are")
        return attempts, (
            f"{self.path.name} was damaged: the original is kept as {aside.name}, and the "
            f"{len(attempts)} {noun} in it that can be read {verb} in use."
        )

    def _free_name(self) -> Path:
        number = 1
        while (aside := self.path.with_name(f"{self.path.name}.corrupt-{number}")).exists():
            number += 1
        return aside

    @contextmanager
    def _hold_lock(self) -> Iterator[None]:
        # Where no file can be made, say so at once: the library would wait or make folders.
        os.close(os.open(self._lock, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644))
        lock = FileLock(self._lock, timeout=LOCK_TIMEOUT_S)
        try:
            lock.acquire()
        except Timeout:
            raise AttemptsError(
                f"Another window has been writing {self.path.name} for {LOCK_TIMEOUT_S:.0f} s: "
                "close it, then submit again."
            ) from None
        try:
            yield
        finally:
            lock.release()

    def _submitted_error(self, attempt: int) -> AttemptsError:
        return AttemptsError(
            f"Attempt {attempt} has been submitted already, in another window: run this cell again "
            "to see its result."
        )

    def _unwritable_error(self, error: OSError) -> UnwritableError:
        return UnwritableError(
            f"Nothing can be saved in {self.path.parent} ({error.strerror or error}): you can go "
            "on, but attempts made now do not count until the folder can be written."
        )
