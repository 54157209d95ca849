"""Unpack a hand-in, within the bounds that nbgrader has for a submission and in its own folder.

No more of a file is written than the archive says that there is; what it says is looked at before.
"""

from __future__ import annotations

import shutil
import zipfile
from collections.abc import Mapping
from pathlib import Path

from autograder.assignments.intake.handed_files import archives
from autograder.assignments.intake.handed_files.file_names import printable_name
from autograder.gradebook.staging import StagingLimits
from autograder.util.work_files import MAX_DEPTH, MAX_FILES

MAX_NAME_BYTES = 255
"""Bytes of the name of a file or folder on Linux."""


class NotTakenError(Exception):
    """One hand-in that is not collected; the message says why."""


def is_inside(name: str) -> bool:
    """Whether a name is a path below the folder that it is put in, on any system."""
    parts = name.split("/")
    return len(parts) <= MAX_DEPTH and all(
        part not in ("", ".", "..")
        and not set(part) & {"\\", "\0"}
        and len(part.encode("utf-8", "surrogatepass")) <= MAX_NAME_BYTES
        for part in parts
    )


def check_bounds(files: Mapping[str, zipfile.ZipInfo], limits: StagingLimits) -> None:
    """Refuse a hand-in that would unpack to more than nbgrader takes, before any of it is read."""
    if len(files) > MAX_FILES:
        raise NotTakenError(f"it has {len(files)} files, more than {MAX_FILES}")
    for name, entry in files.items():
        if entry.file_size > limits.max_file:
            raise NotTakenError(
                f"{printable_name(name)} has {entry.file_size / 1e6:.0f} MB unpacked, more than "
                f"the {limits.max_file / 1e6:.0f} MB that nbgrader takes "
                "(CourseDirectory.max_file_size)"
            )
    unpacked = sum(entry.file_size for entry in files.values())
    if unpacked > limits.max_all:
        raise NotTakenError(
            f"it has {unpacked / 1e6:.0f} MB unpacked, more than the {limits.max_all / 1e6:.0f} MB "
            "that nbgrader takes (CourseDirectory.max_dir_size)"
        )


def unpack_file(archive: zipfile.ZipFile, entry: zipfile.ZipInfo, path: Path, name: str) -> None:
    """Write one file, no more of it than the archive says that there is."""
    if entry.flag_bits & archives.ENCRYPTED_FLAG:
        raise NotTakenError(f"{printable_name(name)} is encrypted")
    if entry.compress_type not in archives.METHODS:
        raise NotTakenError(f"{printable_name(name)} is packed in a way that is not read")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with archive.open(entry) as member, path.open("xb") as file:
            shutil.copyfileobj(member, file)
    except (FileExistsError, IsADirectoryError, NotADirectoryError):
        raise NotTakenError(f"{printable_name(name)} is a file and a folder in it") from None
    except OSError:
        raise  # no room, or no right to write there
    except archives.DAMAGE as error:
        raise NotTakenError(f"{printable_name(name)} is damaged ({str(error)[:100]})") from None
