"""``python -m course.interfaces``: build the bundled packages beforehand."""

from __future__ import annotations

import sys

from course.errors import CourseError
from course.interfaces import Source, cache_root, ensure, install
from course.interfaces.bundled import PACKAGES


def main() -> int:
    """Build what is not built; return 0, or 1 if something could not be."""
    install()
    code = 0
    for package in PACKAGES:
        try:
            source = ensure(package)
        except CourseError as error:
            sys.stderr.write(f"{error}\n")
            code = error.exit_code
        else:
            where = "installed" if source is Source.ROS else f"built, in {cache_root()}"
            sys.stdout.write(f"{package}: {where}\n")
    return code


if __name__ == "__main__":
    sys.exit(main())
