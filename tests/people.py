"""Unix users with ids and homes of their own, on a machine that does not get to know them.

Their commands run in a mount namespace with an /etc/passwd that has them in it. There, too, lies
what they need of this Python where a folder above it is closed to them, as root's home is.
"""

from __future__ import annotations

import functools
import grp
import os
import pwd
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path

FIRST_ID = 52_000
"""Ids from here on are tried until one is free."""

PROJECT = Path(__file__).parents[1]

PROBE = """
from importlib.util import find_spec
for name in ("autograder.cli", "course.command_line.cli", "nbgrader.apps", "rclpy"):
    assert find_spec(name), name
open("mine", "w").close()
"""


@dataclass(frozen=True)
class Person:
    """A user: name, user and group id, and a home that nobody else may enter."""

    name: str
    number: int
    home: Path


class People:
    """Some users whose homes lie in a folder."""

    def __init__(self, folder: Path, names: Iterable[str], tools: Iterable[Path] = ()) -> None:
        """Give each of ``names`` a home in ``folder``, which everybody may enter.

        The way is open to the folders ``tools``, too.
        """
        self.folder = folder
        self._tools = {path.resolve() for path in tools}
        folder.chmod(0o755)
        free = (n for n in range(FIRST_ID, 60_000) if not _is_taken(n))
        self._people = {
            name: Person(name, number, folder / name)
            for name, number in zip(names, free, strict=False)
        }
        for person in self._people.values():
            person.home.mkdir(mode=0o700)
            self.give(person.name, person.home)
        self._etc = self._write_etc()

    def __getitem__(self, name: str) -> Person:
        """Return a user."""
        return self._people[name]

    def give(self, name: str, path: Path) -> None:
        """Make a user the owner of a file, or of a folder and all that is in it."""
        number = self[name].number
        for place in (path, *path.rglob("*")):
            os.chown(place, number, number, follow_symlinks=False)

    def start(
        self, name: str, *command: str, cwd: Path | None = None, log: Path | None = None
    ) -> subprocess.Popen[str]:
        """Start a command as a user, in their home or in ``cwd``.

        ``root`` knows the users, too. With ``log``, what it says goes there.
        """
        person = Person("root", 0, self.folder) if name == "root" else self[name]
        env = {
            "HOME": str(person.home),
            "USER": name,
            "PATH": f"{Path(sys.executable).parent}:/usr/local/bin:/usr/bin:/bin:/usr/sbin:/sbin",
            "LANG": "C.UTF-8",
            "PYTHONWARNINGS": "ignore",
            "COLUMNS": "200",
        }
        # As root, bubblewrap makes no user namespace: the ids are real ones.
        namespace = ["bwrap", "--die-with-parent", "--dev-bind", "/", "/", "--cap-add", "ALL"]
        for path in sorted(self._etc.iterdir()):
            namespace += ["--ro-bind", str(path), f"/etc/{path.name}"]
        namespace += [*self._opened(), "--chdir", str(cwd or person.home)]
        as_user = [
            "setpriv", f"--reuid={person.number}", f"--regid={person.number}", "--clear-groups",
            "--bounding-set=-all", "--inh-caps=-all",
        ]  # fmt: skip
        if person.number == 0:
            as_user = []
        with log.open("wb") if log else nullcontext(subprocess.PIPE) as said:
            return subprocess.Popen(
                [*namespace, *as_user, *command], env=env, stdin=subprocess.DEVNULL,
                stdout=said, stderr=subprocess.STDOUT if log else said, text=True,
            )  # fmt: skip

    def run(self, name: str, *command: str, cwd: Path | None = None, code: int = 0) -> str:
        """Run a command as a user; return what it printed, and see that it ends with ``code``."""
        return finished(self.start(name, *command, cwd=cwd), code)

    def _opened(self) -> Iterator[str]:
        """Yield what opens the way to Python, to this project and to the homes."""
        needed = {Path(p).absolute() for p in (sys.prefix, sys.base_prefix, PROJECT)}
        needed |= {path.resolve() for path in needed} | self._tools
        closed = {p: _closed_above(p) for p in sorted(needed | {self.folder})}
        for above in sorted({above for above in closed.values() if above is not None}):
            yield from ("--perms", "0755", "--tmpfs", str(above))
        for path, above in closed.items():
            if above is not None:
                between = [p for p in reversed(path.parents) if p.is_relative_to(above)]
                for folder in between[1:]:  # which only root could enter otherwise
                    yield from ("--perms", "0755", "--dir", str(folder))
                bind = "--bind" if path == self.folder else "--ro-bind"
                yield from (bind, str(path), str(path))

    def _write_etc(self) -> Path:
        etc = self.folder / "etc"
        etc.mkdir()
        people = self._people.values()
        passwd = [f"{p.name}:x:{p.number}:{p.number}::{p.home}:/bin/sh\n" for p in people]
        group = [f"{p.name}:x:{p.number}:\n" for p in people]
        for name, lines in {"passwd": passwd, "group": group}.items():
            known = Path("/etc", name).read_text(encoding="utf-8").rstrip("\n")
            (etc / name).write_text(f"{known}\n{''.join(lines)}", encoding="utf-8")
        return etc

    def set_passwords(self, password: str) -> None:
        """Let all of them sign in with a password, as PAM checks it."""
        # Python 3.13 has no crypt any more; Debian has Perl wherever it has passwords.
        hashed = subprocess.run(
            ["perl", "-e", "print crypt($ARGV[0], q($6$tests$))", password],
            capture_output=True, text=True, check=True, timeout=60,
        ).stdout  # fmt: skip
        lines = "".join(f"{name}:{hashed}:20000:0:99999:7:::\n" for name in self._people)
        shadow = self._etc / "shadow"
        shadow.touch(mode=0o600)
        shadow.write_text(f"root:*:20000:0:99999:7:::\n{lines}", encoding="utf-8")


def finished(process: subprocess.Popen[str], code: int = 0) -> str:
    """Return what a command printed once it has ended, which must be with ``code``."""
    with process:
        out, err = process.communicate(timeout=600)
    assert process.returncode == code, f"{process.args}: {out}{err}"
    return out + err


@functools.cache
def problem() -> str:
    """Say why nobody else can be acted for here; empty if somebody can."""
    if os.geteuid() != 0:
        return "Only root can act for several Unix users."
    if missing := [tool for tool in ("bwrap", "setpriv") if shutil.which(tool) is None]:
        return f"{missing[0]} is missing, with which root acts for several Unix users."
    with tempfile.TemporaryDirectory() as folder:
        try:
            People(Path(folder), ["somebody"]).run("somebody", sys.executable, "-c", PROBE)
        except (AssertionError, OSError, subprocess.SubprocessError) as error:
            return f"Root cannot act for another Unix user: {str(error)[-300:]}"
    return ""


def _closed_above(path: Path) -> Path | None:
    """Return the uppermost folder above a path that not everybody may enter."""
    above = (parent for parent in reversed(path.parents) if not parent.stat().st_mode & 0o001)
    return next(above, None)


def _is_taken(number: int) -> bool:
    for find in (pwd.getpwuid, grp.getgrgid):
        try:
            find(number)
        except KeyError:
            continue
        return True
    return False
