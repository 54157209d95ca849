"""``autograder wheelhouse``: a folder from which the course installs without any network.

pip gets the wheels, at the versions that were tested (`content.constraints_file`), from wherever it
is set up to look; what there is only as source it builds. They come beside the earlier ones and
take their place at the end, so that a folder never holds half of each.
"""

from __future__ import annotations

import json
import platform
import shutil
import subprocess
import sys
import venv
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from tempfile import TemporaryDirectory
from urllib.parse import urlsplit
from urllib.request import url2pathname

from autograder.util.work_files import scratch_folder
from course.errors import CourseError
from course.util.files import write_text
from course.workspace import content

PROJECT = "ros2-course"
WHEELS, README = "wheels", "README.txt"

README_TEXT = """\
The course {project} {version}, to be installed without any network.

On Linux x86-64 with Python {python} (these wheels were chosen for {exactly}), in this folder:

    python{python} -m venv ~/ros2-course-env && ~/ros2-course-env/bin/pip install --no-index \
--find-links wheels {project}

Then:

    ~/ros2-course-env/bin/course doctor     what works here, and what does not
    ~/ros2-course-env/bin/course lab        JupyterLab with the course

Not in this folder: Python itself (Debian and Ubuntu: python3-venv), a compiler for ROS interfaces
of your own (g++, python3-dev), and what the grader's sandbox needs (bubblewrap, iproute2,
nftables).
"""


class WheelhouseError(CourseError):
    """A wheelhouse that could not be made; the message says why and what to do."""


@dataclass(frozen=True)
class Wheelhouse:
    """A folder that was made: how many wheels, and how many bytes they have."""

    folder: Path
    count: int
    size: int


def make_wheelhouse(
    folder: Path, wheel: Path | None = None, *, say: Callable[[str], None] = lambda _line: None
) -> Wheelhouse:
    """Make a folder with the wheels of the course and of all that it needs.

    Args:
        folder: where; what else lies there is left alone.
        wheel: the course's own; if it is None it is built, or taken from where it was installed
            from.
        say: is told what is going on.

    Raises:
        WheelhouseError: a wheel cannot be got or built, or the folder cannot be written.
    """
    source, constraints = _find_source(wheel), content.constraints_file()
    wheels, partial = folder / WHEELS, folder / f"{WHEELS}.partial"
    if wheels.is_dir() and any(path.suffix != ".whl" for path in wheels.iterdir()):
        raise WheelhouseError(
            f"{wheels} holds other things than wheels, and would be replaced: name another folder."
        )
    try:
        folder.mkdir(parents=True, exist_ok=True)
        shutil.rmtree(partial, ignore_errors=True)
        say("Getting some 200 wheels, 180 MB in all; that takes a minute or several.")
        with _pip() as pip:
            _run_pip(pip, source, constraints, partial)
        shutil.rmtree(wheels, ignore_errors=True)
        partial.rename(wheels)
        write_text(folder / README, _readme_text(wheels))
    except OSError as error:
        raise WheelhouseError(
            f"{folder} cannot be written ({error.strerror or error}): make room there, or name "
            "another folder."
        ) from error
    finally:
        shutil.rmtree(partial, ignore_errors=True)
    found = list(wheels.iterdir())
    return Wheelhouse(folder, len(found), sum(path.stat().st_size for path in found))


def _find_source(wheel: Path | None) -> Path:
    """Return what pip makes the course's own wheel of: a wheel, or the clone."""
    if wheel is not None:
        if not (wheel.is_file() and wheel.name.startswith(PROJECT.replace("-", "_"))):
            raise WheelhouseError(f"{wheel} is no wheel of {PROJECT}: name its file.")
        return wheel
    if (clone := content.clone_root()) is not None:
        return clone
    installed = _installed_from()
    if installed is None:
        raise WheelhouseError(
            "The course was installed from a wheel that is not here any more: name its file with "
            "--wheel, or run this command in a clone of the course."
        )
    return installed


def _installed_from() -> Path | None:
    """Return the wheel that the course was installed from, if it is still there."""
    told = metadata.distribution(PROJECT).read_text("direct_url.json")
    url = str(json.loads(told)["url"]) if told else ""
    path = Path(url2pathname(urlsplit(url).path))
    return path if url.startswith("file:") and path.is_file() else None


@contextmanager
def _pip() -> Iterator[list[str]]:
    """Give the command for pip; an environment that uv made has none."""
    if any(metadata.distributions(name="pip")):
        yield [sys.executable, "-m", "pip"]
        return
    with scratch_folder() as folder:
        try:
            venv.create(folder / "env", with_pip=True)
        except (subprocess.CalledProcessError, ImportError):
            raise WheelhouseError(
                "There is no pip for this Python: install it (Debian and Ubuntu: sudo apt install "
                "python3-venv), then run the same command again."
            ) from None
        yield [str(folder / "env" / "bin" / "python"), "-m", "pip"]


def _run_pip(pip: list[str], source: Path, constraints: Path, to: Path) -> None:
    command = [
        *pip, "wheel", "--quiet", "--no-input", "--disable-pip-version-check",
        "--wheel-dir", str(to), "--constraint", str(constraints), str(source),
    ]  # fmt: skip
    with TemporaryDirectory() as elsewhere:  # where no folder has the name of a package
        done = subprocess.run(
            command, cwd=elsewhere, stdin=subprocess.DEVNULL, capture_output=True, text=True,
            check=False,
        )  # fmt: skip
    if done.returncode != 0:
        said = [line.strip() for line in done.stderr.splitlines() if line.startswith("ERROR")]
        raise WheelhouseError(
            f"pip could not get all wheels ({(said or ['no reason given'])[-1][:300]}): look at "
            "the network and at pip's settings, then run the same command again."
        )


def _readme_text(wheels: Path) -> str:
    [own] = wheels.glob(f"{PROJECT.replace('-', '_')}-*.whl")
    major, minor, _ = platform.python_version_tuple()
    return README_TEXT.format(
        project=PROJECT, version=own.name.split("-")[1], python=f"{major}.{minor}",
        exactly=platform.python_version(),
    )  # fmt: skip
