"""Attempts are never lost: not by a crash, a second window, a damaged file or a full disk."""

from __future__ import annotations

import os
import resource
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from quizzes.attempts.record import Attempt, Given, parse_attempts
from quizzes.attempts.storage import AttemptsFile
from quizzes.errors import AttemptsError, UnwritableError

WRITER = """
import sys
from pathlib import Path
from quizzes.attempts.storage import AttemptsFile
from quizzes.errors import AttemptsError
from quizzes.attempts.record import Attempt, Given

folder, student, first, last = sys.argv[1:]
file = AttemptsFile(Path(folder), "sample")
for number in range(int(first), int(last)):
    given = {f"concept-{n}": Given(f"variant-{n}", "abc") for n in range(5)}
    try:
        file.append(Attempt("sample", student, number, "e", "now", given, 1.0, 1, False))
        print(number, flush=True)
    except AttemptsError as error:
        print(f"refused: {error}", flush=True)
"""


def attempt(number: int = 1, student: str = "ada", answer: str | float = "b") -> Attempt:
    given = {"one": Given("one-1", answer)}
    return Attempt("sample", student, number, "edition", "2026-01-01", given, 1.0, 1, True)


def write(folder: Path, student: str, first: int, last: int) -> subprocess.Popen[str]:
    command = [sys.executable, "-c", WRITER, str(folder), student, str(first), str(last)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, text=True)


@pytest.fixture
def file(tmp_path: Path) -> AttemptsFile:
    return AttemptsFile(tmp_path, "sample")


def asides(file: AttemptsFile) -> list[str]:
    return sorted(path.name for path in file.path.parent.glob("*.corrupt-*"))


def test_nothing_is_written_before_there_is_something_to_keep(file: AttemptsFile) -> None:
    assert file.read() == ([], "")
    assert list(file.path.parent.iterdir()) == []


def test_what_is_added_is_there(file: AttemptsFile) -> None:
    attempts = [attempt(1), attempt(2, answer=2.5), attempt(1, "Grace Höpper")]
    for one in attempts:
        file.append(one)
    assert AttemptsFile(file.path.parent, "sample").read() == (attempts, "")


def test_an_attempt_is_recorded_once(file: AttemptsFile) -> None:
    file.append(attempt(1))
    with pytest.raises(AttemptsError, match="Attempt 1 has been submitted already"):
        file.append(attempt(1, answer="c"))
    assert file.read()[0] == [attempt(1)]


def test_windows_that_write_at_the_same_time_lose_nothing(tmp_path: Path) -> None:
    def run(student: str) -> str:
        return write(tmp_path, student, 1, 26).communicate(timeout=120)[0]

    with ThreadPoolExecutor(4) as pool:
        said = list(pool.map(run, ["ada", "ada", "grace", "alan"]))
    assert not any("refused" in text for text in said[2:])
    refused = said[0].count("refused") + said[1].count("refused")
    assert refused == 25, "of two windows on one attempt, one is told"
    attempts, notice = AttemptsFile(tmp_path, "sample").read()
    assert notice == ""
    assert sorted((a.student, a.attempt) for a in attempts) == [
        (student, number) for student in ("ada", "alan", "grace") for number in range(1, 26)
    ]


def test_a_crash_at_any_moment_loses_nothing_that_was_recorded(tmp_path: Path) -> None:
    recorded: set[int] = set()
    for round_ in range(4):
        process = write(tmp_path, "ada", round_ * 1000 + 1, round_ * 1000 + 1000)
        assert process.stdout is not None
        for _ in range(5 + round_):
            recorded.add(int(process.stdout.readline()))
        process.send_signal(signal.SIGKILL)
        recorded |= {int(line) for line in process.communicate()[0].splitlines()}
    attempts, notice = AttemptsFile(tmp_path, "sample").read()
    assert notice == ""
    assert recorded <= {a.attempt for a in attempts}


@pytest.mark.parametrize(
    "rubbish",
    [
        attempt(2).to_json()[:-20].encode(),
        b"\x00\xff\xfe",
        b"[]",
        b"{}",
        b"null",
        b"[" * 50_000,
        b'{"version": 1}',
        attempt(2).to_json().replace('"version": 1', '"version": 2').encode(),
        attempt(2).to_json().replace('"attempt": 2', '"attempt": -2').encode(),
        attempt(2).to_json().replace('"attempt": 2', '"attempt": true').encode(),
        attempt(2).to_json().replace('"score": 1.0', '"score": NaN').encode(),
        attempt(2).to_json().replace('"score": 1.0', '"score": 1' + "0" * 400).encode(),
        attempt(2).to_json().replace('"b"', "1e305").encode(),
        attempt(2).to_json().replace('"b"', "1" + "0" * 400).encode(),
        attempt(2).to_json().replace('"b"', '["b"]').encode(),
        attempt(2).to_json().replace('"b"', "1" + "0" * 5000).encode(),
        attempt(2).to_json().replace("ada", "a" * 300).encode(),
        attempt(2).to_json().replace("ada", "a" * 70_000).encode(),
    ],
)
def test_a_damaged_file_is_kept_aside_and_its_sound_part_stays_in_use(
    file: AttemptsFile, rubbish: bytes
) -> None:
    file.append(attempt(1))
    damaged = file.path.read_bytes() + rubbish
    file.path.write_bytes(damaged)
    attempts, notice = file.read()
    assert attempts == [attempt(1)]
    assert notice == (
        "quiz-sample.attempts.jsonl was damaged: the original is kept as "
        "quiz-sample.attempts.jsonl.corrupt-1, and the 1 attempt in it that can be read is in "
        "use."
    )
    assert (file.path.parent / asides(file)[0]).read_bytes() == damaged
    file.append(attempt(2))
    assert file.read() == ([attempt(1), attempt(2)], "")


def test_a_file_cut_anywhere_never_joins_lines(file: AttemptsFile) -> None:
    file.append(attempt(1))
    first = file.path.read_bytes()
    file.append(attempt(2))
    whole = file.path.read_bytes()
    for end in range(len(first) - 1, len(whole)):
        file.path.write_bytes(whole[:end])
        file.append(attempt(3))
        kept = [1, 2, 3] if end == len(whole) - 1 else [1, 3]
        found, notice = file.read()
        assert ([a.attempt for a in found], notice) == (kept, "")


def test_a_byte_order_mark_costs_no_attempt(file: AttemptsFile) -> None:
    file.append(attempt(1))
    file.path.write_bytes(b"\xef\xbb\xbf" + file.path.read_bytes().replace(b"\n", b"\r\n"))
    file.append(attempt(2))
    assert file.read() == ([attempt(1), attempt(2)], "")


def test_each_damaged_file_is_kept_under_a_name_of_its_own(file: AttemptsFile) -> None:
    for number in range(1, 4):
        file.path.write_bytes(b"rubbish %d" % number)
        file.read()
        assert len(asides(file)) == number
    contents = {(file.path.parent / name).read_bytes() for name in asides(file)}
    assert contents == {b"rubbish 1", b"rubbish 2", b"rubbish 3"}


def test_adding_to_a_damaged_file_mends_it_first(file: AttemptsFile) -> None:
    file.path.write_bytes(attempt(1).to_json().encode()[:50])
    file.append(attempt(1))
    assert file.read() == ([attempt(1)], "")
    assert len(asides(file)) == 1


def test_a_full_disk_leaves_no_half_line(tmp_path: Path) -> None:
    """A limit on the size of files cuts a write short, as a disk does that is nearly full."""
    file = AttemptsFile(tmp_path, "sample")
    file.append(attempt(1))
    before = file.path.read_bytes()
    room = len(before) + 30

    def limit() -> None:
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (room, room))

    said = subprocess.run(
        [sys.executable, "-B", "-c", WRITER, str(tmp_path), "ada", "2", "3"],
        capture_output=True, text=True, preexec_fn=limit, timeout=60, check=False,
    )  # fmt: skip
    assert said.stdout.startswith("refused: Nothing can be saved in"), said
    assert file.path.read_bytes() == before
    assert file.read() == ([attempt(1)], "")


@pytest.mark.parametrize("folder", ["/proc", "/proc/self/fdinfo", "/nowhere"])
def test_a_folder_that_takes_no_files_is_one_sentence(folder: str) -> None:
    file = AttemptsFile(Path(folder), "sample")
    assert file.read() == ([], "")
    with pytest.raises(UnwritableError, match=rf"Nothing can be saved in {folder} \(.+\): you can"):
        file.append(attempt(1))
    with pytest.raises(UnwritableError, match="do not count until"):
        file.save_draft("ada", 1, "edition", {})


@pytest.fixture
def read_only() -> Iterator[Path]:
    """Give a folder that this process may not write, whoever runs the tests."""
    nobody, me = 65534, os.geteuid()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "quiz-sample.attempts.jsonl").write_text(f"{attempt(1).to_json()}\nrubbish")
        folder.chmod(0o555)
        if me == 0:  # root may write everywhere
            os.seteuid(nobody)
        try:
            yield folder
        finally:
            os.seteuid(me)
            folder.chmod(0o755)


def test_in_a_read_only_folder_attempts_are_read_and_the_rest_is_one_sentence(
    read_only: Path,
) -> None:
    file = AttemptsFile(read_only, "sample")
    attempts, notice = file.read()
    assert attempts == [attempt(1)]
    assert notice.startswith(f"Nothing can be saved in {read_only} (")
    with pytest.raises(UnwritableError, match="Nothing can be saved in"):
        file.append(attempt(2))


@pytest.mark.parametrize("kind", ["folder", "pipe", "endless"])
def test_something_else_in_the_place_of_the_file_is_one_sentence(
    file: AttemptsFile, kind: str
) -> None:
    if kind == "folder":
        file.path.mkdir()
    elif kind == "pipe":
        os.mkfifo(file.path)
    else:
        file.path.symlink_to("/dev/zero")
    attempts, notice = file.read()
    assert attempts == []
    assert "cannot be read" in notice
    with pytest.raises(UnwritableError):
        file.append(attempt(1))


def test_unsubmitted_answers_are_kept_until_their_attempt_is_recorded(file: AttemptsFile) -> None:
    assert file.read_draft() == {}
    file.save_draft("ada", 1, "edition", {"one": "b"})
    assert file.save_draft("ada", 1, "edition", {"two": "ü"}) == {"one": "b", "two": "ü"}
    assert file.read_draft() == {
        "quiz": "sample", "student": "ada", "attempt": 1, "edition": "edition",
        "answers": {"one": "b", "two": "ü"},
    }  # fmt: skip
    file.append(attempt(1, "grace"))
    assert file.read_draft()["student"] == "ada"
    file.append(attempt(1))
    assert file.read_draft() == {}
    with pytest.raises(AttemptsError, match="Attempt 1 has been submitted already"):
        file.save_draft("ada", 1, "edition", {"one": "c"})
    assert file.save_draft("ada", 2, "edition", {"one": "c"}) == {"one": "c"}
    assert file.save_draft("ada", 2, "another", {"two": "d"}) == {"two": "d"}


def test_windows_that_answer_at_the_same_time_lose_nothing(tmp_path: Path) -> None:
    def answer(number: int) -> None:
        AttemptsFile(tmp_path, "sample").save_draft("ada", 1, "edition", {f"c{number}": "a"})

    with ThreadPoolExecutor(8) as pool:
        list(pool.map(answer, range(40)))
    kept = AttemptsFile(tmp_path, "sample").read_draft()["answers"]
    assert kept == {f"c{number}": "a" for number in range(40)}


def test_a_huge_file_is_read_in_part_and_not_mistaken_for_whole() -> None:
    line = attempt(1).to_json().encode() + b"\n"
    attempts, damaged = parse_attempts(line * (5 * 1024 * 1024 // len(line)))
    assert attempts
    assert damaged
