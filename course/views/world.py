"""The simulated world: seen from above, in words, and with its controls."""

from __future__ import annotations

import functools
import time
from collections.abc import Callable
from typing import Any, Concatenate, ParamSpec, TypeVar

from course.errors import CourseError
from course.runtime.core_session import CoreSession
from course.views import world_picture, world_words
from course.views.shared.live_view import SLOW_PERIOD_S, Frame, LiveView
from course.views.shared.truncate import cut_text
from course.worlds.running_world import RunningWorld

ENDED = "This world has ended: its node was stopped, or another world was made."

SPEEDS = (0.25, 0.5, 1.0, 2.0, 4.0)
"""Factors of wall time that the view offers."""

MAX_TOPICS = 24
"""Topics that are listed."""

MAX_MARKS = 300
"""Points of trail and path, obstacles, people and so on that are drawn, of each so many."""

MAX_TEXT_CHARS = 300
"""Characters of a name, a sentence or a message."""


Arguments = ParamSpec("Arguments")
Returned = TypeVar("Returned")


def _pass_on(
    control: Callable[Concatenate[RunningWorld, Arguments], Returned],
) -> Callable[Concatenate[World, Arguments], Returned]:
    """Return a method of the view that is the simulation's: `help()` and types are the same."""

    @functools.wraps(control)
    def use(self: World, /, *args: Arguments.args, **kwargs: Arguments.kwargs) -> Returned:
        return control(self.simulation, *args, **kwargs)

    return use


class World(LiveView):
    """A world from above: the robot, what its LIDAR sees, what your nodes planned and found.

    A cell has the same controls as the browser::

        world = course.world("warehouse")
        world.press_stop()
        world.set_fault("wheels", "jammed")

    Attributes:
        simulation: the world itself, a ROS 2 node of the session.
    """

    label = "World"
    script = "world"
    shared = ("forms", "world_things", "world_canvas", "world_controls")
    period = 0.04  # s: what moves less often than that is seen to jump
    fixed_parts = ("floor",)
    slow_parts = ("trail", "path", "found", "topics", "news")

    def __init__(self, session: CoreSession, simulation: RunningWorld) -> None:
        """Show ``simulation``, which runs in ``session``."""
        self._floor = simulation.describe_floor()
        super().__init__(session, self._floor["name"])
        self.simulation = simulation
        self._topics: list[dict[str, Any]] = []
        self._topics_due = 0.0
        self._chosen = ""
        self._problem = ""

    pause = _pass_on(RunningWorld.pause)
    resume = _pass_on(RunningWorld.resume)
    step_once = _pass_on(RunningWorld.step_once)
    reset = _pass_on(RunningWorld.reset)
    drive = _pass_on(RunningWorld.drive)
    close = _pass_on(RunningWorld.close)
    press_stop = _pass_on(RunningWorld.press_stop)
    release_stop = _pass_on(RunningWorld.release_stop)
    set_fault = _pass_on(RunningWorld.set_fault)
    add_obstacle = _pass_on(RunningWorld.add_obstacle)
    move_obstacle = _pass_on(RunningWorld.move_obstacle)
    remove_obstacle = _pass_on(RunningWorld.remove_obstacle)

    def handle_control(self, message: dict[str, Any]) -> None:
        """Do what a button, a key or the pointer asks for; what cannot be done is said."""
        try:
            self._do_control(message)
            self._problem = ""
        except CourseError as error:
            self._problem = str(error)
        self._topics_due = 0.0

    def make_frame(self) -> Frame:
        """Return the floor, this moment and the topics: lengths in m, beams in cm."""
        return self._frame_of(self.simulation.describe_moment())

    def words(self) -> str:
        """Return where the robot is, which way it looks, what is near, its state and the news."""
        return self._words_of(self.simulation.describe_moment())

    def look(self) -> tuple[Frame, str]:
        """Return both, of one and the same moment."""
        moment = self.simulation.describe_moment()
        return self._frame_of(moment), self._words_of(moment)

    def tick(self, now: float) -> float:
        """Send a frame if one is due, as other views do, until the world has ended."""
        if self.simulation.closed and not self.session.closed:
            self.end(ENDED)
        return super().tick(now)

    def picture(self) -> str:
        """Return the floor and this moment as an SVG document."""
        moment = self.simulation.describe_moment()
        return world_picture.draw_world(self._floor, moment, self._words_of(moment))

    def _do_control(self, message: dict[str, Any]) -> None:
        match message:
            case {"do": ("pause" | "resume" | "step_once" | "reset") as name}:
                getattr(self, name)()
            case {"do": ("press_stop" | "release_stop") as name}:
                getattr(self, name)()
            case {"drive": [speed, turn]}:
                self.drive(speed, turn)
            case {"speed": factor} if factor in SPEEDS:
                self.simulation.speed = factor
            case {"fault": [str(what), str(state)]}:
                self.set_fault(what, state)
            case {"move": [int(number), x, y]}:
                self.move_obstacle(number, x, y)
            case {"add": [x, y]}:
                self.add_obstacle(x, y)
            case {"remove": int(number)}:
                self.remove_obstacle(number)
            case {"topic": str(name)}:
                self._chosen = name

    def _frame_of(self, moment: dict[str, Any]) -> Frame:
        return {
            "floor": self._floor,
            "time": round(moment["time"], 2),
            "paused": self.simulation.paused,
            "speed": self.simulation.speed,
            "robot": {name: _round(value) for name, value in moment["robot"].items()},
            "beams": [None if beam is None else round(beam * 100) for beam in moment["beams"]],
            "people": _round_rows(moment["people"]),
            "obstacles": _round_rows(moment["obstacles"]),
            "faults": moment["faults"],
            "problem": self._problem,
            "trail": _round_rows(moment["trail"]),
            "path": _round_rows(moment["path"]),
            "found": _round_rows(moment["found"]),
            "news": [cut_text(line, MAX_TEXT_CHARS) for line in moment["news"]],
            "topics": [self._topic_data(topic) for topic in self._look_at_topics()],
        }

    def _words_of(self, moment: dict[str, Any]) -> str:
        simulation = self.simulation
        pace = "paused" if simulation.paused else f"running at {simulation.speed:g}x"
        return world_words.describe_world(self._floor, moment, self._look_at_topics(), pace)

    def _look_at_topics(self) -> list[dict[str, Any]]:
        """Return the topics as they were up to `SLOW_PERIOD_S` ago: their messages are long."""
        now = time.monotonic()
        if now >= self._topics_due:
            self._topics, self._topics_due = (
                self.simulation.topics[:MAX_TOPICS],
                now + SLOW_PERIOD_S,
            )
        return self._topics

    def _topic_data(self, topic: dict[str, Any]) -> dict[str, Any]:
        """Return a row of the list; what the topic carries only of the one that was chosen."""
        row = {"name": topic["name"], "type": topic["type"], "rate": topic["rate"]}
        if topic["name"] == self._chosen:
            row["last"] = cut_text(str(topic["last"]), MAX_TEXT_CHARS)
        return row


def _round(value: Any) -> Any:
    return round(value, 3) if isinstance(value, float) else value


def _round_rows(rows: list[list[Any]]) -> list[list[Any]]:
    """Return at most `MAX_MARKS` rows, their lengths to the centimetre."""
    return [[round(v, 2) if isinstance(v, float) else v for v in row] for row in rows[-MAX_MARKS:]]
