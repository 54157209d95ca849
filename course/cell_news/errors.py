"""What to do about an error that a cell raised, where rclpy or Python do not say it."""

from __future__ import annotations

from rclpy.exceptions import NotInitializedException

from course.learner_session.default_session import current_session
from course.runtime.context.context import default_context
from course.runtime.nodes.uninitialised import explain_uninitialised

_INIT_TWICE = "Context.init() must only be called once"


def explain_error(error: BaseException | None) -> str:
    """Return a sentence about what a cell raised; empty where the error says enough."""
    if isinstance(error, NotInitializedException):
        return (
            "This node was made where rclpy was not initialised: pass its class to the session, "
            "without parentheses, as in course.run(Talker), or call course.session() first."
        )
    if isinstance(error, RuntimeError) and _INIT_TWICE in str(error):
        return _explain_second_init()
    if isinstance(error, NameError) and error.name in ("session", "course", "rclpy"):
        return (
            f"This kernel does not know {error.name!r} yet: after a start or restart it knows "
            "nothing of the cells above. Run those first (in the menu Run: Run All Above Selected "
            "Cell), then this one."
        )
    return explain_uninitialised(error) if error is not None else ""


def _explain_second_init() -> str:
    session = current_session()
    if session is not None and default_context() is session.context:
        return (
            "The course's session has initialised rclpy for this notebook already: leave "
            "rclpy.init() out, or call course.close() before it."
        )
    return (
        "An earlier cell has called rclpy.init() itself, and rclpy can be initialised once only: "
        "leave this call out, or call rclpy.shutdown() before it. The course's session needs "
        "neither."
    )
