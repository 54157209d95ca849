"""The five scenarios: what each needs, what is asked about it, and what each pattern would mean.

Which choice is right is in the hidden cell's key and nowhere else. No text of a question names a
pattern, so who reads all of them still has to think; the meanings say who asks, who waits, how
often, and what nobody would know.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from autograder.observe.choices import Choices, Question
from autograder.observe.stepped_time.declared_parameters import SET_PARAMETERS

FIBONACCI = "example_interfaces/action/Fibonacci or test_msgs/action/Fibonacci"
"""The chapter's Fibonacci, and what stands in for it on a machine without a compiler."""


class Scenario(NamedTuple):
    """One of the ways in which the rest of the system deals with the robot.

    Attributes:
        topic: its name on the ROS graph, whatever that stands for there.
        works_as: {pattern: type or types} that can be used as the task describes it.
        needed: what the others rely on, as sentences.
    """

    topic: str
    works_as: Mapping[str, str]
    needed: str


SCENARIOS: dict[str, Scenario] = {
    "position": Scenario(
        "robot/position",
        {"service": "std_srvs/srv/Trigger", "topic": "std_msgs/msg/Float64"},
        "A node that wants to know the position gets it in metres, at most 0.5 s old, also while "
        "the robot stands still.",
    ),
    "camera": Scenario(
        "robot/camera",
        {"topic": "sensor_msgs/msg/Image"},
        "Pictures come by themselves, 10 a second, for any number of viewers.",
    ),
    "navigation": Scenario(
        "robot/navigate",
        {"action": FIBONACCI},
        "Somebody names a station, hears of each one that is passed, and learns how it ended.",
    ),
    "parameters": Scenario(
        "robot/max_speed",
        {"service": SET_PARAMETERS},
        "A node that changes max_speed is told whether the new value was accepted, or why not.",
    ),
    "battery": Scenario(
        "robot/battery",
        {"topic": "sensor_msgs/msg/BatteryState"},
        "A node that listens to robot/battery knows a new level within 1 s. Its percentage is "
        "0.0 to 1.0.",
    ),
}

CHOICES = Choices(
    "choices",
    ("topic", "service", "action"),
    {
        "position": Question(
            "Requesting the robot's position: the pattern fits.",
            "A node that asks goes on with the answer, so it has to be there at once.",
            (
                "Who begins the exchange, and how many are interested in this answer?",
                "How long does it take until the answer is there?",
                "There is nothing to wait for, no progress to hear of, and nothing to call off.",
            ),
            {
                "topic": "Nobody has to ask: the newest message answers all who listen, as "
                "odometry does on most robots. A node that needs one position must subscribe and "
                "wait for a message.",
                "service": "A node that needs one position asks for it, waits a moment, and goes "
                "on with an answer as fresh as the question.",
                "action": "For an answer that is there at once, a node would send a goal, "
                "wait for it to be accepted, and then wait for a result; there is no progress to "
                "report and nothing to call off.",
            },
        ),
        "camera": Question(
            "Publishing camera images: the pattern fits.",
            "Pictures come all the time, whether anybody looks or not.",
            (
                "Who begins: the one who looks, or the one who has the pictures?",
                "How many may look at the same time, and does the camera have to know them?",
                "The data come all the time, several look, and nobody should wait for anybody.",
            ),
            {
                "topic": "The driver sends each picture once and waits for nobody; anyone may "
                "look.",
                "service": "Each viewer would have to ask for each picture, ten times a second, "
                "and wait for the answer: five viewers make fifty calls a second, and see the "
                "camera stutter.",
                "action": "Each viewer would have to send a goal to see anything, and pictures "
                "have no end at which there were a result.",
            },
        ),
        "navigation": Question(
            "Sending a navigation goal: the pattern fits.",
            "A drive takes minutes, and a lot can happen on the way.",
            (
                "How long does it take until the robot is there?",
                "What would you like to hear, and to be able to do, while it is on its way?",
                "It takes long, reports on the way, comes to an end, and can be called off.",
            ),
            {
                "topic": "The sender would never hear whether anyone took the "
                "goal, how far the robot is, or whether it arrived, and has no way to call off "
                "this one drive.",
                "service": "The call would hang for as long as the drive takes, minutes perhaps: "
                "no word of how far the robot is, and no way to call it back before it arrives.",
                "action": "The sender hears how far the robot is and whether it "
                "arrived, and can call it off on the way.",
            },
        ),
        "parameters": Question(
            "Updating robot parameters: the pattern fits.",
            "A change that nobody confirms may not have happened.",
            (
                "What do you have to know after you have changed a value?",
                "How long does a change take, and how many are asked to make it?",
                "It is quick, it is between two, and it needs a yes or a no.",
            ),
            {
                "topic": "The sender of a new value would never hear whether it holds: a bad one "
                "would be dropped without a word, or driven with.",
                "service": "The node that changes a value asks for it and hears at once whether it "
                "holds, or why it does not.",
                "action": "A change is done as soon as it is asked for: there is no progress to "
                "watch and nothing to call off, but every change would take three exchanges "
                "instead of one.",
            },
        ),
        "battery": Question(
            "Broadcasting the battery level: the pattern fits.",
            "Displays, loggers and planners come and go; the robot should not have to know them.",
            (
                "How many want to know the level, and do they have to ask?",
                "Who knows first that the level has changed?",
                "One tells, many listen, and it goes on for as long as the robot is on.",
            ),
            {
                "topic": "The level is sent once for everybody who listens, and nobody has to ask.",
                "service": "Each display, logger and planner would have to ask again and again; "
                "between two questions a level that falls goes unseen.",
                "action": "Everyone who wants to know the level would have to send a goal, and a "
                "level never ends in a result.",
            },
        ),
    },
)
