"""Entry points of the two commands: look at the platform first, then import the rest.

On a platform without ROS 2 the import itself would fail, in a traceback.
"""

from __future__ import annotations

import atexit
import gc
import importlib
import os
import signal
import sys

from course.util.platform_check import (
    WHEELS_ANEW,
    WHEELS_TORN,
    UnsupportedPlatformError,
    has_rclpy,
    require_supported_platform,
)


def course() -> None:
    """Run the ``course`` command."""
    _run_command("course", "course.command_line.cli")


def autograder() -> None:
    """Run the ``autograder`` command."""
    _run_command("autograder", "autograder.cli")


def _run_command(name: str, module: str) -> None:
    try:
        require_supported_platform()
    except UnsupportedPlatformError as error:
        sys.stderr.write(f"{name}: {error}\n")
        sys.exit(error.exit_code)
    # nbgrader starts alembic by name, a learner's terminal `course`: both lie beside this Python,
    # whose folder need not be on the PATH (as with pipx).
    scripts = os.path.dirname(sys.executable)  # noqa: PTH120 - nothing else is imported yet
    os.environ["PATH"] = os.pathsep.join([scripts, os.environ.get("PATH", os.defpath)])
    _collect_garbage_seldom()
    # Checked here, before the command has begun. The doctor reports it in its own way.
    if not has_rclpy() and sys.argv[1:2] != ["doctor"]:
        sys.stderr.write(f"{name}: {WHEELS_TORN} {WHEELS_ANEW}\n")
        sys.exit(2)
    try:
        importlib.import_module(module).main()
    except KeyboardInterrupt:  # it takes a second until the command itself sees to Ctrl-C
        sys.stderr.write(f"{name}: stopped.\n")
        sys.exit(128 + signal.SIGINT)


def _collect_garbage_seldom() -> None:
    """Spare a command the garbage collector's looks at what is imported: two thousand modules.

    By default it looks at every 700 new objects, all of which stay, and once more at all of them
    when the process ends: together a second of a grading run.
    """
    gc.set_threshold(100_000, 50, 100)
    atexit.register(gc.freeze)
