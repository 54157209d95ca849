"""The five scenarios, and what each communication pattern would mean for each of them in use.

Nothing here says which one is right: that is in the hidden cell's key, and in how a built node
works. Each text says who asks, who waits, how often, and what nobody would know.
"""

from __future__ import annotations

from typing import Literal

Scenario = Literal["position", "camera", "navigation", "parameters", "battery"]

SCENARIOS: tuple[Scenario, ...] = ("position", "camera", "navigation", "parameters", "battery")
PATTERNS = ("topic", "service", "action")

NAMES: dict[Scenario, str] = {
    "position": "robot/position",
    "camera": "robot/camera",
    "navigation": "robot/navigate",
    "parameters": "robot/max_speed",
    "battery": "robot/battery",
}

_MEANING: dict[Scenario, dict[str, str]] = {
    "position": {
        "topic": "Nobody has to ask: the newest message answers whoever listens, as odometry does "
        "on most robots. Whoever needs one position must subscribe and wait for a message.",
        "service": "Whoever needs one position asks for it, waits a moment, and goes on with an "
        "answer as fresh as the question.",
        "action": "For an answer that is there at once, whoever asks would send a goal, wait for "
        "it to be accepted, and then wait for a result; there is no progress to report and nothing "
        "to call off.",
    },
    "camera": {
        "topic": "The driver sends each picture once and waits for nobody; anyone may look.",
        "service": "Each viewer would have to ask for each picture, ten times a second, and wait "
        "for the answer: five viewers make fifty calls a second, and see the camera stutter.",
        "action": "Each viewer would have to send a goal to see anything, and pictures have no "
        "end at which there were a result.",
    },
    "navigation": {
        "topic": "Whoever sends the robot off would never hear whether anyone took the goal, how "
        "far the robot is, or whether it arrived, and has no way to call off this one drive.",
        "service": "The call would hang for as long as the drive takes, minutes perhaps: no word "
        "of how far the robot is, and no way to call it back before it arrives.",
        "action": "Whoever sends the robot off hears how far it is and whether it arrived, and can "
        "call it off on the way.",
    },
    "parameters": {
        "topic": "Whoever sends a new value would never hear whether it holds: a bad one would be "
        "dropped without a word, or driven with.",
        "service": "Whoever changes a value asks for it and hears at once whether it holds, or why "
        "it does not.",
        "action": "A change is done as soon as it is asked for: there is no progress to watch and "
        "nothing to call off, but every change would take three exchanges instead of one.",
    },
    "battery": {
        "topic": "The level is sent once for everybody who listens, and nobody has to ask.",
        "service": "Each display, logger and planner would have to ask again and again; between "
        "two questions a level that falls goes unseen.",
        "action": "Everyone who wants to know the level would have to send a goal, and a level "
        "never ends in a result.",
    },
}


def would_mean(scenario: Scenario, pattern: str) -> str:
    """Return what a pattern means in use for a scenario, in one or two sentences."""
    return _MEANING[scenario][pattern]
