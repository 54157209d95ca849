"""What went wrong in the transitions of managed nodes, of which rclpy itself tells nobody.

An exception in ``on_configure()`` and its siblings becomes the return value ERROR, unseen
(https://github.com/ros2/rclpy/pull/1673); a transition that a state does not have is an error of
the state machine, and where a service asked for it, the service does not answer
(https://github.com/ros2/rclpy/issues/1209).
"""

from __future__ import annotations

import itertools
import linecache
import sys
import traceback
import weakref
from collections import deque
from dataclasses import dataclass
from typing import Any, Literal

from lifecycle_msgs.msg import State
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.lifecycle import LifecycleNodeMixin, LifecycleState, TransitionCallbackReturn
from rclpy.node import Node

from course.runtime.callbacks.callback_errors import learner_frames
from course.runtime.ros_names import node_name

Kind = Literal["raised", "returned", "stuck", "refused"]

_KEPT_FAILURES = 10  # a node
_MAX_CHARS = 500  # characters of what was raised
_numbers = itertools.count(1)
_failed: weakref.WeakKeyDictionary[Node, deque[FailedTransition]] = weakref.WeakKeyDictionary()


@dataclass(frozen=True)
class FailedTransition:
    """A transition that did not lead where it should.

    It keeps texts alone: an exception would keep alive what its frames refer to.

    Attributes:
        node: fully qualified name of the node.
        kind: its callback "raised", or "returned" FAILURE or ERROR; it returned something else, and
            the node is "stuck"; or the state has no such transition, and it was "refused".
        what: what happened, a sentence.
        traceback: of what was raised, from the learner's own code on; else empty.
        number: counts all of this process.
    """

    node: str
    kind: Kind
    what: str
    traceback: str
    number: int

    def __str__(self) -> str:
        """Return what happened, as a sentence."""
        return self.what


def state_of(node: LifecycleNodeMixin) -> str:
    """Return the state of a managed node: ``inactive``, or while it is under way ``activating``."""
    return str(node._state_machine.current_state[1])


def failed_transitions(node: Node) -> list[FailedTransition]:
    """Return what went wrong since the last transition of `node` that succeeded."""
    return list(_failed.get(node, ()))


def watch_transitions() -> None:
    """Note from now on what goes wrong in the transitions of all nodes. Idempotent."""
    for name, made in ((_EXECUTE, _execute_callback), (_CHANGE, _change_state)):
        if getattr(LifecycleNodeMixin, name) is not made:
            setattr(LifecycleNodeMixin, name, made)


# Methods of rclpy's, under the names that Python gives to private ones.
_EXECUTE = "_LifecycleNodeMixin__execute_callback"
_CHANGE = "_LifecycleNodeMixin__change_state"
_rclpys_change: Any = getattr(LifecycleNodeMixin, _CHANGE)


def _execute_callback(self: Any, current_state_id: int, previous_state: LifecycleState) -> Any:
    """Do what rclpy's own method does, and note what comes out."""
    callback = self._callbacks.get(current_state_id)
    if callback is None:
        return TransitionCallbackReturn.SUCCESS
    name = getattr(callback, "__qualname__", "a callback").replace("<locals>.", "")
    where = f"{name} of {node_name(self)}"
    try:
        returned = callback(previous_state)
    except Exception as error:  # noqa: BLE001 - as rclpy does
        what = f"{where} raised {_describe_error(error)}. rclpy hides it and "
        what += (
            "finalizes the node."
            if current_state_id == State.TRANSITION_STATE_ERRORPROCESSING
            else "calls on_error()."
        )
        frames = learner_frames(error.__traceback__)
        text = "".join(traceback.format_exception(type(error), error, frames)).rstrip()
        _note_failure(self, "raised", what, text)
        return TransitionCallbackReturn.ERROR
    if returned == TransitionCallbackReturn.SUCCESS:
        if current_state_id != State.TRANSITION_STATE_ERRORPROCESSING:
            _failed.pop(self, None)
    elif isinstance(returned, TransitionCallbackReturn):
        _note_failure(self, "returned", f"{where} returned {returned.name}.")
    else:
        state = state_of(self)
        _note_failure(
            self, "stuck", f"{where} returned {type(returned).__name__}, which is no "
            f"TransitionCallbackReturn: rclpy stops half-way, and the node stays {state}.",
        )  # fmt: skip
    return returned


def _change_state(self: Any, transition_id: int) -> Any:
    before = state_of(self)
    try:
        return _rclpys_change(self, transition_id)
    except rclpy_implementation.RCLError:
        if state_of(self) == before:
            known = {item[0]: item[1] for item in self._state_machine.transition_graph}
            leads = sorted({item[1] for item in self._state_machine.available_transitions})
            _note_failure(
                self, "refused", f"{node_name(self)} was asked to "
                f"{known.get(transition_id, f'make transition {transition_id}')} and cannot: it is "
                f"{before}, from where it can {' or '.join(leads) or 'do nothing more'}.",
            )  # fmt: skip
        raise


def _note_failure(node: Any, kind: Kind, what: str, text: str = "") -> None:
    found = FailedTransition(node_name(node), kind, what, text, next(_numbers))
    _failed.setdefault(node, deque(maxlen=_KEPT_FAILURES)).append(found)


def _describe_error(error: Exception) -> str:
    """Return type, message and the learner's own line of an exception."""
    try:
        message = " ".join(str(error).split())[:_MAX_CHARS]
    except Exception:  # noqa: BLE001 - a learner's exception class may be broken itself
        message = ""
    place = ""
    for frame, line in traceback.walk_tb(error.__traceback__):
        package = str(frame.f_globals.get("__name__", "")).partition(".")[0]
        if package not in ("rclpy", "course") and package not in sys.stdlib_module_names:
            text = linecache.getline(frame.f_code.co_filename, line).strip()
            place = f" (line {line}: {text})" if text else f" (line {line})"
    return f"{type(error).__name__}{f': {message}' if message else ''}{place}".rstrip(".")
