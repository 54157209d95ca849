"""The state of a course: rows are written whole, by several processes; damage is one sentence."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from autograder.util.state_table import FILE, StateError, StateTable


def test_a_row_is_known_by_its_kind_its_assignment_and_its_name(tmp_path: Path) -> None:
    table = StateTable(tmp_path / "work", "kind", "ch05")
    assert table.get("ada") is None
    assert table.rows() == {}
    table.remove("ada")
    assert not (tmp_path / "work").exists(), "who only reads writes nothing"
    table.put("1", "ada", "qos")
    table.put("2", "ada/qos")
    table.put("3", "\udcff")  # a folder's name that is no text
    table.put("4")
    assert table.rows() == {(): "4", ("ada", "qos"): "1", ("ada/qos",): "2", ("\udcff",): "3"}
    assert StateTable(tmp_path / "work", "kind", "ch06").get("ada", "qos") is None
    assert StateTable(tmp_path / "work", "other", "ch05").get("ada", "qos") is None
    table.remove("ada", "qos")
    assert table.get("ada", "qos") is None
    assert table.get("ada/qos") == "2"


def test_a_revision_tells_what_was_written_later_even_after_a_removal(tmp_path: Path) -> None:
    table = StateTable(tmp_path, "kind")
    table.put("a", "x")
    table.put("b", "mark")
    since = table.revision("mark")
    table.remove("mark")
    assert table.get("x", since=since) is None
    table.put("c", "y")
    assert table.get("y", since=since) == "c"
    table.put("d", "x")
    assert table.get("x", since=since) == "d"


def test_half_a_character_is_replaced_and_nobody_else_may_read(tmp_path: Path) -> None:
    table = StateTable(tmp_path, "kind")
    table.put("\ud800 robot", "x")
    assert table.get("x") == "? robot"
    assert (tmp_path / FILE).stat().st_mode & 0o777 == 0o600


@pytest.mark.parametrize("damage", [b"no database" * 100, b"\0" * 5000])
def test_a_damaged_file_is_one_sentence_and_stays_where_it_is(
    tmp_path: Path, damage: bytes
) -> None:
    (tmp_path / FILE).write_bytes(damage)
    table = StateTable(tmp_path, "kind")
    for use in (table.rows, lambda: table.put("a", "x")):
        with pytest.raises(StateError, match=r"is damaged .* put a copy of it back"):
            use()
    assert (tmp_path / FILE).read_bytes() == damage


def test_what_cannot_be_opened_is_an_error_of_the_system(tmp_path: Path) -> None:
    (tmp_path / FILE).mkdir()
    with pytest.raises(OSError, match="directory"):
        StateTable(tmp_path, "kind").put("a", "x")


WRITER = """
import sys
from pathlib import Path
from autograder.util.state_table import StateTable
table = StateTable(Path(sys.argv[1]), "kind")
for number in range(50):
    table.put(str(number), sys.argv[2], str(number))
"""


def test_several_processes_write_at_a_time(tmp_path: Path) -> None:
    writers = [
        subprocess.Popen([sys.executable, "-P", "-c", WRITER, tmp_path, name]) for name in "abcd"
    ]
    assert [writer.wait(timeout=120) for writer in writers] == [0] * 4
    assert len(StateTable(tmp_path, "kind").rows()) == 200
