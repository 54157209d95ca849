"""The machine: space, shared memory, the log folder, the clock."""

from __future__ import annotations

import datetime
import os
import shutil
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from course.doctor.finding import HealthFinding, make_ok, make_problem, make_warning
from course.util import cgroups, operating_system

MIN_DISK, LOW_DISK = 50, 500  # MB: below, a build fails; below, a class's submissions may
LOW_SHM_MB = 32  # MB. A participant takes about 1 MB, and Docker gives 64 by default.
SHM = Path("/dev/shm")


def examine_machine() -> Iterator[HealthFinding]:
    """Yield what there is to say about disk, shared memory, log folder and clock."""
    yield check_disk(Path.cwd())
    yield temporary_folder()
    if operating_system.is_linux():
        yield shared_memory(SHM)
        yield stale_segments(SHM, Path("/proc/locks"))
    yield log_folder(os.environ.get("ROS_LOG_DIR"), os.environ.get("ROS_HOME"))
    yield check_clock(time.time(), Path(__file__).stat().st_mtime)
    if operating_system.is_linux():
        yield check_counting(cgroups.delegated_group())


def check_counting(group: Path | None) -> HealthFinding:
    """Say how it is counted what a submission uses that is graded here."""
    name = "submissions' limits"
    if group is not None:
        return make_ok(name, f"the kernel counts what a submission uses (cgroups v2, in {group})")
    return make_ok(
        name,
        "the grader counts what a submission uses, ten times a second; the kernel would where "
        "systemd delegates a control group (systemd-run --user --scope -p Delegate=yes …)",
    )


def check_disk(folder: Path, free: int | None = None) -> HealthFinding:
    """Look at the space where notebooks are saved; ``free`` is in MB, measured if left out."""
    free = shutil.disk_usage(folder).free >> 20 if free is None else free
    text, mend = f"{free} MB are free in {folder}", "Make room there."
    if free < MIN_DISK:
        return make_problem("disk", f"{text}: notebooks and grades cannot be saved.", mend)
    if free < LOW_DISK:
        return make_warning("disk", f"{text}, which is little.", mend)
    return make_ok("disk", text)


def temporary_folder() -> HealthFinding:
    """Look whether temporary files can be written."""
    try:
        with tempfile.TemporaryFile() as file:
            file.write(b"x" * 4096)
            file.flush()
            return make_ok("temporary files", f"{tempfile.gettempdir()} can be written")
    except OSError as error:
        return make_problem(
            "temporary files",
            f"They cannot be written ({error.strerror or error}).",
            "Make room in /tmp, or set TMPDIR to a folder of your own.",
        )


def shared_memory(folder: Path, free: int | None = None) -> HealthFinding:
    """Look at DDS's fast path between processes; ``free`` is in MB, measured if left out."""
    name = "shared memory"
    if not (folder.is_dir() and os.access(folder, os.W_OK)):
        return make_warning(
            name,
            f"{folder} cannot be written, so DDS uses slower UDP.",
            "In a container: mount a tmpfs there.",
        )
    free = shutil.disk_usage(folder).free >> 20 if free is None else free
    if free < LOW_SHM_MB:
        return make_warning(
            name,
            f"Only {free} MB are free in {folder}; with many nodes DDS falls back to slower UDP.",
            "In a container: start it with --shm-size=256m.",
        )
    return make_ok(name, f"{free} MB are free in {folder}")


def stale_segments(folder: Path, locks: Path) -> HealthFinding:
    """Count the segments of DDS participants that were killed.

    A living participant holds a lock on its ``*_el`` file, which ``locks`` (``/proc/locks``)
    lists by inode. Nothing is opened or locked here, so no running program is disturbed.
    """
    name = "left-over segments"
    try:
        held = {line.split()[5].rpartition(":")[2] for line in _lock_lines(locks)}
    except OSError as error:
        return make_ok(name, f"They could not be counted ({error.strerror or error})")
    files = [path for path in folder.glob("fastrtps_*") if "port" not in path.name]
    inodes = {
        path.name.removesuffix("_el"): str(found.st_ino)
        for path in files
        if path.name.endswith("_el") and (found := _stat_file(path))
    }
    stale = {name for name, inode in inodes.items() if inode not in held}
    # A class that was killed leaves ten thousand: each is looked at once.
    parts = [_stat_file(path) for path in files if _segment_of(path) in stale]
    size = sum(found.st_size for found in parts if found) >> 20
    if not stale:
        return make_ok(name, "none")
    return make_warning(
        name,
        f"{len(stale)} shared-memory locks or segments ({size} MB) were left in {folder} by ROS "
        "programs that were killed.",
        "When no ROS program runs: rm -f /dev/shm/fastrtps_* /dev/shm/sem.fastrtps_*",
    )


def _segment_of(path: Path) -> str:
    """Return the segment that a file is a part of: ``fastrtps_0123`` of ``fastrtps_0123_el``."""
    return "_".join(path.name.split("_")[:2])


def _stat_file(path: Path) -> os.stat_result | None:
    """Look at a file, which its program may have removed in the meantime."""
    try:
        return path.stat()
    except OSError:
        return None


def _lock_lines(locks: Path) -> Iterator[str]:
    for line in locks.read_text(encoding="ascii").splitlines():
        if len(line.split()) >= 8 and "->" not in line:  # "->" marks one who waits for the lock
            yield line


def log_folder(chosen: str | None, ros_home: str | None) -> HealthFinding:
    """Look whether ROS can write its log files; rclpy does not start without."""
    folder = Path(chosen or Path(ros_home or "~/.ros") / "log").expanduser()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=folder):
            return make_ok("log folder", f"{folder} can be written")
    except OSError as error:
        return make_warning(
            "log folder",
            f"{folder} cannot be written ({error.strerror or error}), and plain rclpy does not "
            "start then. Sessions of the course log to a temporary folder instead.",
            "Set ROS_LOG_DIR to a folder of your own.",
        )


def check_clock(now: float, installed: float) -> HealthFinding:
    """Compare the clock (s since 1970) with when this file was installed."""
    shown = datetime.datetime.fromtimestamp(now).astimezone().isoformat(" ", "seconds")
    if now < installed - 60:
        return make_warning(
            "clock",
            f"It says {shown}, which is before the course was installed: time stamps of messages "
            "and submissions will be wrong.",
            "Set the machine's clock.",
        )
    return make_ok("clock", shown)
