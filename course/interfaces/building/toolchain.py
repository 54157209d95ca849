"""The C and C++ compilers, and turning generated sources into one shared library."""

from __future__ import annotations

import errno
import os
import shlex
import shutil
import signal
import subprocess
import sys
import sysconfig
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from course.interfaces import installed
from course.interfaces.errors import BuildError, CompilerMissingError

INSTALL = (
    "install them with `sudo apt-get install g++ python3-dev` (Debian, Ubuntu), "
    "`sudo dnf install gcc-c++ python3-devel` (Fedora) or your distribution's equivalent"
)
DEADLINE_S = 300.0  # seconds for one command; a build takes about 3
# -O0: the code runs once a message, and the wait for it is a learner's. -w: nobody reads warnings
# of generated code.
FLAGS = ("-c", "-fPIC", "-O0", "-w")
# The libraries of an interface package that another one's code calls.
LIBRARIES = (
    "rosidl_generator_c",
    "rosidl_generator_py",
    "rosidl_typesupport_c",
    "rosidl_typesupport_fastrtps_c",
    "rosidl_typesupport_introspection_c",
)
RUNTIME = (
    "rosidl_typesupport_c",
    "rosidl_typesupport_fastrtps_c",
    "rosidl_typesupport_fastrtps_cpp",
    "rosidl_typesupport_introspection_c",
    "rosidl_runtime_c",
    "rosidl_dynamic_typesupport",
    "rcutils",
    "rmw",
    "fastcdr",
    "dl",
)


@dataclass(frozen=True)
class Toolchain:
    """Commands of the compilers, as argument lists."""

    cc: tuple[str, ...]
    cxx: tuple[str, ...]


def compiler_problem() -> str | None:
    """Return what is missing for building interfaces, as one sentence with the mend, or None."""
    try:
        find_toolchain()
    except CompilerMissingError as error:
        return str(error)
    return None


def find_toolchain() -> Toolchain:
    """Find the compilers (``CC`` and ``CXX`` win) and Python's headers.

    Raises ``CompilerMissingError`` naming everything that is missing.
    """
    if sys.platform == "darwin":
        raise CompilerMissingError(
            "ROS interfaces are built on Linux only: on a Mac, install "
            "ros-jazzy-example-interfaces from RoboStack, and define your own ones on Linux."
        )
    cc, cxx = (
        find_command("CC", ("gcc", "cc", "clang")),
        find_command("CXX", ("g++", "c++", "clang++")),
    )
    missing = [
        what
        for what, found in (
            ("a C compiler (gcc)", cc),
            ("a C++ compiler (g++)", cxx),
            ("Python's headers (Python.h)", python_headers()),
        )
        if not found
    ]
    if missing:
        raise CompilerMissingError(
            f"Building ROS interfaces needs {' and '.join(missing)}, not found here: {INSTALL}."
        )
    return Toolchain(cc, cxx)


def find_command(variable: str, names: Sequence[str]) -> tuple[str, ...]:
    """Return the command that ``variable`` names, or the first of ``names`` on the path."""
    chosen = shlex.split(os.environ.get(variable, ""))
    for command in [chosen] if chosen else [[name] for name in names]:
        path = shutil.which(command[0])
        if path:
            return (path, *command[1:])
    return ()


def python_headers() -> list[str]:
    """Return the folders of Python.h and pyconfig.h (empty: not installed)."""
    folders = list(dict.fromkeys(sysconfig.get_path(p) for p in ("include", "platinclude")))
    found = any((Path(folder) / "Python.h").is_file() for folder in folders)
    return folders if found else []


def build_environment(scratch: Path) -> dict[str, str]:
    """Return the environment of a build: plain English, and all scratch files in ``scratch``."""
    environment = {**os.environ, "LC_ALL": "C", "PYTHONUTF8": "1", "TMPDIR": str(scratch)}
    environment["AMENT_PREFIX_PATH"] = os.pathsep.join(map(str, installed.ament_prefixes()))
    # The wheels put folders with libraries of their own on the library path; a compiler must not
    # load those in place of the system's.
    ours = str(Path(sys.prefix).resolve())
    kept = [
        folder
        for folder in environment.pop("LD_LIBRARY_PATH", "").split(os.pathsep)
        if folder and not str(Path(folder).resolve()).startswith(ours)
    ]
    if kept:
        environment["LD_LIBRARY_PATH"] = os.pathsep.join(kept)
    return environment


def include_flags(folders: Iterable[Path]) -> list[str]:
    """Return -I and -isystem flags: our folders, the ROS headers, Python's and numpy's."""
    import numpy as np

    system = [np.get_include(), *python_headers()]
    for prefix in installed.ament_prefixes():
        # Each ROS package keeps its headers in include/<package>/<package>/, and a message pulls
        # in those of all that it holds.
        system += sorted(str(f) for f in (prefix / "include").glob("*") if f.is_dir())
        system.append(str(prefix / "include"))
    return [*(f"-I{folder}" for folder in folders), *(f"-isystem{folder}" for folder in system)]


def link_flags(packages: Iterable[str]) -> list[str]:
    """Return the libraries of ``packages`` and of the runtime, and where to find them."""
    folders = [prefix / "lib" for prefix in installed.ament_prefixes() if (prefix / "lib").is_dir()]
    flags = [f"-L{folder}" for folder in folders]
    flags += [f"-Wl,-rpath,{folder},-rpath-link,{folder}" for folder in folders]
    flags.append("-Wl,--as-needed")
    flags += [f"-l{package}__{library}" for package in packages for library in LIBRARIES]
    return flags + [f"-l{library}" for library in RUNTIME]


def run_commands(commands: Sequence[Sequence[str]], folder: Path, what: str) -> None:
    """Run ``commands`` at once in ``folder`` and wait for all.

    Raises ``BuildError`` with the first error line of the first that fails, and
    ``OSError`` if the disk is full. Whatever happens, none of them is left running.
    """
    environment = build_environment(folder)
    processes: list[tuple[Sequence[str], subprocess.Popen[str], Path]] = []
    try:
        for number, command in enumerate(commands):
            log = folder / f"{Path(command[0]).name}-{number}.log"
            with log.open("w", encoding="utf-8") as stream:
                process = subprocess.Popen(
                    command,
                    cwd=folder,
                    env=environment,
                    stdin=subprocess.DEVNULL,
                    stdout=stream,
                    stderr=subprocess.STDOUT,
                    text=True,
                )
            processes.append((command, process, log))
        for command, process, log in processes:
            if process.wait(DEADLINE_S):
                output = log.read_text(encoding="utf-8", errors="replace")
                raise command_error(what, Path(command[0]).name, process.returncode, output)
    except subprocess.TimeoutExpired as error:
        raise BuildError(
            f"Building {what} took longer than {DEADLINE_S:.0f} s and was stopped: "
            "try again when the machine is less busy."
        ) from error
    finally:
        for _, process, _ in processes:
            if process.poll() is None:
                process.kill()
            process.wait()


def command_error(what: str, command: str, code: int, output: str) -> Exception:
    """Turn the output of a failed command into an error for a person."""
    lines = [line.strip() for line in output.splitlines() if line.strip()]
    for number in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG):
        if any(os.strerror(number) in line for line in lines):
            return OSError(number, os.strerror(number))
    # A compiler's first error causes the others; a traceback says what happened in its last line.
    telling = [line for line in lines if " error: " in line] or lines[-1:]
    if code < 0:
        telling = [f"it was ended by {signal.Signals(-code).name}"]
    said = telling[0] if telling else f"it ended with code {code} and said nothing"
    # A compiler can be there without the headers of the C library.
    hint = f" If a header is missing, {INSTALL}." if "No such file" in said else ""
    return BuildError(f"{what} could not be built, because {command} failed: {said}.{hint}")
