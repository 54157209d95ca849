"""Learn the building blocks of ROS 2 in a notebook, on real nodes and real DDS."""

from __future__ import annotations

import importlib
import os
from typing import TYPE_CHECKING, Any

from course.util import platform_check

# Message modules read this when they load: a wrong field type then fails where it is assigned.
os.environ.setdefault("ROS_PYTHON_CHECK_FIELDS", "1")

if platform_check.find_problem() is None:
    # From here on `from example_interfaces.srv import SetBool` finds, or builds, the package.
    from course import interfaces

    interfaces.install()

if TYPE_CHECKING:
    from course.design.declaration import Design as Design
    from course.design.endpoints import DesignError as DesignError
    from course.errors import CourseError as CourseError
    from course.errors import DomainError as DomainError
    from course.errors import SessionError as SessionError
    from course.errors import WaitTimeout as WaitTimeout
    from course.learner_session.default_session import call as call
    from course.learner_session.default_session import close as close
    from course.learner_session.default_session import lives as lives
    from course.learner_session.default_session import logs as logs
    from course.learner_session.default_session import next_message as next_message
    from course.learner_session.default_session import pause as pause
    from course.learner_session.default_session import record as record
    from course.learner_session.default_session import resume as resume
    from course.learner_session.default_session import run as run
    from course.learner_session.default_session import send_goal as send_goal
    from course.learner_session.default_session import session as session
    from course.learner_session.default_session import spin as spin
    from course.learner_session.default_session import stop as stop
    from course.learner_session.default_session import until as until
    from course.learner_session.default_session import wait_for_service as wait_for_service
    from course.learner_session.default_session import world as world
    from course.learner_session.session import Session as Session
    from course.notebook import load_ipython_extension as load_ipython_extension
    from course.notebook import unload_ipython_extension as unload_ipython_extension
    from course.runtime.callbacks.callback_errors import CallbackError as CallbackError
    from course.runtime.context.close_order import CloseReport as CloseReport
    from course.runtime.logs.table import LogTable as LogTable
    from course.runtime.requests.actions import GoalRun as GoalRun
    from course.runtime.requests.actions import GoalState as GoalState
    from course.runtime.requests.recorder import Recorder as Recorder
    from course.runtime.requests.recorder import Stamped as Stamped
    from course.runtime.simulated_time import SimulatedTime as SimulatedTime
    from course.workspace.journal.progress import Progress as Progress
    from course.workspace.journal.progress import progress as progress

_HOMES = {
    "call": "course.learner_session.default_session",
    "close": "course.learner_session.default_session",
    "lives": "course.learner_session.default_session",
    "logs": "course.learner_session.default_session",
    "next_message": "course.learner_session.default_session",
    "pause": "course.learner_session.default_session",
    "record": "course.learner_session.default_session",
    "resume": "course.learner_session.default_session",
    "run": "course.learner_session.default_session",
    "send_goal": "course.learner_session.default_session",
    "session": "course.learner_session.default_session",
    "spin": "course.learner_session.default_session",
    "stop": "course.learner_session.default_session",
    "until": "course.learner_session.default_session",
    "wait_for_service": "course.learner_session.default_session",
    "world": "course.learner_session.default_session",
    "Design": "course.design.declaration",
    "DesignError": "course.design.endpoints",
    "CourseError": "course.errors",
    "DomainError": "course.errors",
    "SessionError": "course.errors",
    "WaitTimeout": "course.errors",
    "Progress": "course.workspace.journal.progress",
    "progress": "course.workspace.journal.progress",
    "load_ipython_extension": "course.notebook",
    "unload_ipython_extension": "course.notebook",
    "GoalRun": "course.runtime.requests.actions",
    "GoalState": "course.runtime.requests.actions",
    "CallbackError": "course.runtime.callbacks.callback_errors",
    "CloseReport": "course.runtime.context.close_order",
    "LogTable": "course.runtime.logs.table",
    "Recorder": "course.runtime.requests.recorder",
    "Stamped": "course.runtime.requests.recorder",
    "Session": "course.learner_session.session",
    "SimulatedTime": "course.runtime.simulated_time",
}


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used: rclpy takes a moment, and a supported platform.

    Raises:
        UnsupportedPlatformError: there is no ROS 2 for this machine.
    """
    if name == "design":  # `course.design.carry(...)` needs no import of its own
        return importlib.import_module("course.design")
    if name not in _HOMES:
        raise AttributeError(f"module 'course' has no attribute {name!r}")
    if _HOMES[name] != "course.errors":
        platform_check.require_supported_platform()
    value = getattr(importlib.import_module(_HOMES[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOMES})
