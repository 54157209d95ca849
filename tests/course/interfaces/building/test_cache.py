"""The cache under fire: builds at once, killed builds, damaged files, folders that take nothing."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from course.interfaces.building import pruning
from course.interfaces.building.locks import locked
from tests.machine import needs_compiler

# A small type builds in a third of the time of example_interfaces.
USE = """
made = interfaces.define("cache_msgs/msg/Small", "int32 x 7")
from cache_msgs.msg import Small
from rclpy.serialization import deserialize_message, serialize_message
print(interfaces.status()["cache_msgs"], deserialize_message(serialize_message(made()), Small).x)
"""
USED = "built 7\n"


def wait_for(condition: Callable[[], object], what: str) -> None:
    deadline, pause = time.monotonic() + 60.0, threading.Event()
    while not condition():
        assert time.monotonic() < deadline, what
        pause.wait(0.01)


def entry(cache: Path) -> Path:
    (manifest,) = cache.glob("*/cache_msgs/*/manifest.json")
    return manifest.parent


def leftovers(cache: Path) -> list[Path]:
    # At their depth only: a search that goes into them finds them gone.
    return list(cache.glob("*/cache_msgs/.building-*"))


@pytest.fixture(scope="module")
def small(built: Path) -> Path:
    """The shared cache with the small type in it."""
    code = f"from course import interfaces\n{USE}"
    environment = {**os.environ, "COURSE_INTERFACES_CACHE": str(built)}
    subprocess.run([sys.executable, "-c", code], env=environment, check=True, timeout=120)
    return built


@pytest.fixture
def cache(small: Path, tmp_path: Path) -> Path:
    """A cache of this test's own, with the small type in it."""
    return Path(shutil.copytree(small, tmp_path / "cache"))


def test_a_second_process_loads_what_the_first_built(python, cache: Path) -> None:
    made = entry(cache).stat().st_ctime_ns
    # No compiler: it cannot have been built again.
    done = python(USE, PATH="/nonexistent", CC="", CXX="")
    assert (done.stdout, done.stderr) == (USED, "")
    assert entry(cache).stat().st_ctime_ns == made


@needs_compiler
def test_two_processes_at_once_build_once(environment, tmp_path: Path) -> None:
    code = f"from course import interfaces; interfaces.install()\n{USE}"
    processes = [
        subprocess.Popen(
            [sys.executable, "-c", code],
            env=environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        for _ in range(2)
    ]
    seen: set[Path] = set()

    def look() -> bool:
        seen.update(leftovers(tmp_path / "cache"))
        return all(process.poll() is not None for process in processes)

    wait_for(look, "two processes build the same type")
    assert [process.communicate() for process in processes] == [(USED, "")] * 2
    assert len(seen) == 1
    assert leftovers(tmp_path / "cache") == []


@needs_compiler
def test_a_build_that_is_killed_is_never_used(environment, python, tmp_path: Path) -> None:
    cache = tmp_path / "cache"
    victim = subprocess.Popen(
        [sys.executable, "-c", f"from course import interfaces; interfaces.install()\n{USE}"],
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    headers = "*/cache_msgs/.building-*/scratch/sources/**/*.h"
    wait_for(lambda: list(cache.glob(headers)), "the generators have begun")
    victim.send_signal(signal.SIGKILL)
    victim.communicate()
    assert leftovers(cache)
    assert not list(cache.rglob("manifest.json"))
    done = python(USE)
    assert (done.stdout, done.stderr) == (USED, "")
    # Its orphaned compilers may go on for a moment; the next builder removes what they leave.
    assert entry(cache).is_dir()


@pytest.mark.parametrize("damage", ["truncated", "missing", "emptied", "no manifest"])
def test_a_damaged_entry_is_built_again(damage: str, python, cache: Path) -> None:
    folder = entry(cache)
    (library,) = folder.glob("*.so")
    if damage == "truncated":
        library.write_bytes(library.read_bytes()[:1000])
    elif damage == "missing":
        (folder / "python/msg/_small.py").unlink()
    elif damage == "emptied":
        (folder / "manifest.json").write_text("{}", encoding="utf-8")
    else:
        (folder / "manifest.json").unlink()
    done = python(USE)
    assert (done.stdout, done.stderr) == (USED, "")
    assert entry(cache) == folder
    assert leftovers(cache) == []


def test_a_library_that_is_whole_and_does_not_load_is_built_again(python, cache: Path) -> None:
    from course.interfaces.building.cache import write_manifest

    folder = entry(cache)
    (library,) = folder.glob("*.so")
    library.write_bytes(b"not a library")
    (folder / "manifest.json").unlink()
    write_manifest(folder)
    done = python(USE)
    assert (done.stdout, done.stderr) == (USED, "")


@needs_compiler
def test_a_cache_that_cannot_be_written_gives_way_to_a_private_folder(python, tmp_path) -> None:
    blocker = tmp_path / "file"
    blocker.write_text("a file, where a folder should be", encoding="utf-8")
    code = USE + (
        "from course.interfaces import packages\n"
        "print(next(iter(packages.loaded.values())).folder)\n"
    )
    done = python(code, COURSE_INTERFACES_CACHE=str(blocker / "cache"))
    assert done.stderr == ""
    status, folder = done.stdout.splitlines()
    assert status == USED.strip()
    assert folder.startswith(f"{tempfile.gettempdir()}/ros2-course-interfaces-")
    assert not Path(folder).exists()


@needs_compiler
def test_a_disk_that_is_full_is_one_sentence(python, tmp_path: Path) -> None:
    # The kernel refuses to let any file of this process grow past 5 kB: the same error path as
    # a full disk, without one.
    code = (
        "import resource, signal\n"
        "signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (5_000, 5_000))\n"
        "try:\n"
        "    interfaces.define('cache_msgs/msg/Small', 'int32 x')\n"
        "except interfaces.BuildError as error:\n"
        "    print(error)\n"
    )
    done = python(code)
    assert done.stderr == ""
    assert done.stdout.startswith("cache_msgs/msg/Small could not be built, because neither ")
    assert f"{tmp_path / 'cache'} (File too large)" in done.stdout
    assert "free some disk space" in done.stdout
    assert len(done.stdout.splitlines()) == 1
    assert leftovers(tmp_path / "cache") == []


def test_a_forked_child_does_not_keep_the_lock(python, tmp_path: Path) -> None:
    code = """
import os
from pathlib import Path
from course.interfaces.building import locks
file = Path("lock")
reader, writer = os.pipe()
with locks.locked(file):
    child = os.fork()
    if child == 0:
        os.close(writer)
        os.read(reader, 1)  # lives until the parent lets go
        os._exit(0)
locks.LOCK_DEADLINE_S = 5.0
with locks.locked(file):
    print("locked again while the child lives")
os.close(writer)
os.waitpid(child, 0)
"""
    done = python(code)
    assert (done.stdout, done.stderr) == ("locked again while the child lives\n", "")


def test_a_lock_that_stays_taken_is_passed_by(python, cache: Path, tmp_path: Path) -> None:
    folder = entry(cache)
    shutil.rmtree(folder)
    with locked(folder.parent / f".{folder.name}.lock"):
        code = f"from course.interfaces.building import locks\nlocks.LOCK_DEADLINE_S = 0.1\n{USE}"
        done = python(code)
    assert (done.stdout, done.stderr) == (USED, "")
    assert not folder.exists()


def test_a_cache_that_is_emptied_in_use_is_filled_again(python, cache: Path) -> None:
    done = python(f"""
import shutil
{USE}
shutil.rmtree({str(cache)!r})
made = interfaces.define("cache_msgs/msg/Larger", "Small small")
print(made().small.x)
""")
    assert (done.stdout, done.stderr) == (USED + "7\n", "")


def test_the_key_of_the_environment_changes_with_what_was_compiled_in(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    from course.interfaces.building.cache import environment_key

    key = environment_key.__wrapped__
    before = key()
    assert key() == before
    assert json.dumps(before).isascii()
    monkeypatch.setattr(sys, "prefix", os.fspath(Path(sys.prefix) / "elsewhere"))
    assert key() != before


def aged(folder: Path, seconds: float) -> Path:
    """Return `folder`, as if it had last been used `seconds` ago."""
    then = time.time() - seconds
    os.utime(folder / pruning.MANIFEST, (then, then))
    return folder


def copies(cache: Path, count: int) -> list[Path]:
    """Return more units like the small one: as old as days can make them different."""
    unit = entry(cache)
    made = [unit.with_name(f"Small-{number:016x}") for number in range(count)]
    return [aged(Path(shutil.copytree(unit, folder)), 86400.0 * 2) for folder in made]


def test_what_nobody_used_for_long_goes_and_the_rest_stays(cache: Path) -> None:
    unit = entry(cache)
    elsewhere = Path(shutil.copytree(unit.parent, cache / "0123456789ab/cache_msgs")) / unit.name
    old = unit.with_name("Small-0000000000000000")
    recent = unit.with_name("Small-0000000000000001")
    for folder in (old, recent):
        aged(Path(shutil.copytree(unit, folder)), 86400.0 * 2)
    aged(old, pruning.UNUSED_FOR_S + 60)
    aged(elsewhere, pruning.UNUSED_FOR_S + 60)  # built for wheels that are no longer installed
    assert sorted(pruning.prune(cache)) == sorted([old, elsewhere])
    assert not old.exists()
    assert not elsewhere.exists()
    assert unit.exists()
    assert recent.exists()
    assert leftovers(cache) == []
    assert pruning.prune(cache) == []


def test_a_cache_that_is_too_full_loses_the_oldest(cache: Path, monkeypatch) -> None:
    made = copies(cache, 5)
    for number, folder in enumerate(made):
        aged(folder, 86400.0 * (2 + number))
    units = len(list(cache.glob(f"*/*/*/{pruning.MANIFEST}")))
    monkeypatch.setattr(pruning, "MAX_UNITS", units - 2)
    assert sorted(pruning.prune(cache)) == sorted(made[-2:])
    monkeypatch.setattr(pruning, "MAX_UNITS", 0)
    assert all(folder in made for folder in pruning.prune(cache))  # not what is in use today
    assert len(list(cache.glob(f"*/*/*/{pruning.MANIFEST}"))) == units - 5


def test_a_unit_that_is_being_built_or_was_used_just_now_stays(cache: Path) -> None:
    (old,) = copies(cache, 1)
    aged(old, pruning.UNUSED_FOR_S + 60)
    with locked(pruning.lock_of(old)):
        assert pruning.prune(cache) == []
    pruning.touch_manifest(old)
    assert pruning.prune(cache) == []
    assert old.exists()


def test_finding_a_unit_counts_as_using_it_and_building_one_prunes(python, cache: Path) -> None:
    unit = aged(entry(cache), pruning.UNUSED_FOR_S + 60)
    (old,) = copies(cache, 1)
    aged(old, pruning.UNUSED_FOR_S + 60)
    done = python(f"{USE}\ninterfaces.define('cache_msgs/msg/Other', 'int32 y')")
    assert (done.stdout, done.stderr) == (USED, "")
    assert unit.exists()
    assert not old.exists()


def test_processes_that_prune_at_once_do_not_disturb_each_other(python, cache: Path) -> None:
    old = [aged(folder, pruning.UNUSED_FOR_S + 60) for folder in copies(cache, 40)]
    code = f"""
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from course.interfaces.building.pruning import prune
import multiprocessing
with ProcessPoolExecutor(4, mp_context=multiprocessing.get_context("spawn")) as pool:
    gone = [folder for folders in pool.map(prune, [Path({str(cache)!r})] * 8) for folder in folders]
print(len(gone), len(set(gone)))
"""
    done = python("if __name__ == '__main__':\n" + code.replace("\n", "\n    "))
    assert (done.stdout, done.stderr) == ("40 40\n", "")
    assert not any(folder.exists() for folder in old)
    assert leftovers(cache) == []


def test_a_lock_that_was_deleted_while_it_was_waited_for_is_taken_anew(tmp_path: Path) -> None:
    file = tmp_path / "lock"
    inside = []

    def wait_and_take() -> None:
        with locked(file, deadline=60.0):
            inside.append(file.stat().st_ino)

    with locked(file):
        waiting = threading.Thread(target=wait_and_take)
        waiting.start()
        file.unlink()
    waiting.join()
    assert len(inside) == 1
    assert file.exists()
