"""The robot under examination: its hardware is the examiner's, its interface the student's.

The robot's wheels are patient: it moves only while the student's node commands a speed, and only
when a check has it roll on. So a drive takes as long as the student's code needs, on simulated time
or on the wall's, and what comes before what is known for certain.
"""

from __future__ import annotations

import secrets
from dataclasses import dataclass, field

from sensor_msgs.msg import BatteryState, Image
from std_msgs.msg import Float64

from autograder.examination.check_context import CheckContext
from autograder.exercises.patterns.scenarios import SCENARIOS
from autograder.observe import Parameter, Topic
from autograder.observe.examiner.merged_subscriptions import MergedSubscription
from autograder.observe.examiner.quiet_node import QuietNode
from autograder.observe.graph.name_patterns import Patterns
from autograder.observe.stepped_time.declared_parameters import DeclaredParameter
from autograder.observe.stepped_time.late_subscription import LateSubscription
from autograder.observe.stepped_time.stepped_observer import Host, SteppedObserver
from autograder.observe.stillness import Stillness

NODE, THREADS = "RobotInterface", 4
SPEED_AT_START = 0.5  # m/s
POSITION, CHARGE = Topic("hardware/position", Float64), Topic("hardware/charge", Float64)
SPEED = Topic("hardware/speed", Float64, value=lambda message: message.data)
LEVELS = Topic("robot/battery", BatteryState, value=lambda message: message.percentage)
# Not the pixels: a camera of 640 x 480 sends nearly 10 MB a second.
PICTURES = Topic("robot/camera", Image, value=lambda m: (m.width, m.height, m.step, len(m.data)))


@dataclass
class Findings:
    """What checks have found that others need, in all parts of an examination.

    Attributes:
        offers: which pattern each scenario really is, with its type.
        works: scenarios that work while the robot stands; also "aisle", that a drive waits in a
            blocked one.
        position_by: the pattern by which the position can be learnt; empty if it cannot.
    """

    offers: dict[str, Patterns] = field(default_factory=dict)
    works: set[str] = field(default_factory=set)
    position_by: str = ""


class Robot(SteppedObserver):
    """The robot during an examination, in the student's session or in a plain program.

    Attributes:
        found: what checks have found.
        position: where the hardware said last that it is (m).
        max_speed: the speed limit in m/s.
        first_top: the highest speed (m/s) of a first drive, if nobody had set a limit before.
        obeys: whether it has been found to drive at the limit.
        overheard: listens to the position, once that has been found to be a topic.
    """

    def __init__(self, bench: CheckContext, host: Host | None = None) -> None:
        """Bring up the hardware beside a ``host``, by default the session of the student's."""
        host = host or Host.of_subject(bench)
        node = host.session.run(lambda: QuietNode(f"examiner_{secrets.randbelow(2**24)}"))
        assert isinstance(node, QuietNode)
        super().__init__(host, Stillness(bench.outside), node)
        self.bench, self.subject, self.draws = bench, bench.subject, bench.draws
        self.found: Findings = bench.memory.setdefault("robot", Findings())
        self.advertise(POSITION, CHARGE)
        self.speeds = MergedSubscription(node, SPEED)
        self.levels = MergedSubscription(node, LEVELS)
        self.pictures = MergedSubscription(node, PICTURES)
        self.position = 0.0
        limit = Parameter("max_speed", SPEED_AT_START)
        self.max_speed = DeclaredParameter(self, limit, f"/{SCENARIOS['parameters'].topic}")
        self.first_top: float | None = None
        self.obeys = False
        self.overheard: LateSubscription | None = None

    @property
    def speed(self) -> float:
        """The last commanded speed in m/s."""
        return float(self.speeds.last or 0.0)

    def start(self) -> None:
        """Have the student's node made, on simulated time.

        Raises:
            StudentError: it could not be made.
        """
        self.subject.open(threads=THREADS, sim_time=True)
        self.subject.start(NODE)
        self.note_standstill()

    def report(self, topic: Topic, value: float) -> None:
        """Have the hardware report a value once, and the student's node take it in."""
        if topic is POSITION:
            self.position = value
        self.send(topic, Float64(data=value))
