# title: An object of one's own that makes the nodes, without the library's design
# fails: nothing

from functools import partial

from rclpy.action import ActionServer
from rclpy.node import Node


class Part(Node):
    """A node that passes what it reads on to what it writes."""

    def __init__(self, name, reads=(), writes=(), serves=None, calls=None, goals=False):
        super().__init__(name)
        self.outputs = [self.create_publisher(kind, topic, 10) for topic, kind in writes]
        for topic, kind in reads:
            self.create_subscription(kind, topic, self.pass_on, 10)
        if serves:
            self.create_service(GetPlan, serves, lambda request, response: response)
        if calls:
            self.client = self.create_client(GetPlan, calls)
        if goals:
            self.server = ActionServer(self, NavigateTo, "/navigate_to", self.navigate)

    def pass_on(self, received):
        for output in self.outputs:
            message = output.msg_type()
            if course.design.carry(received, message):
                output.publish(message)

    def navigate(self, goal):
        self.pass_on(goal.request)
        goal.succeed()
        return NavigateTo.Result()


class Robot:
    SCAN = ("/scan", LaserScan)
    IMAGE = ("/camera/image", Image)
    WHEELS = ("/wheel/odometry", Odometry)
    MAP = ("/map", OccupancyGrid)
    POSE = ("/pose", PoseStamped)
    OBSTACLES = ("/obstacles", Float32)
    VELOCITY = ("/velocity", Twist)

    def node_factories(self):
        return {
            "hardware": partial(Part, "hardware", writes=[self.SCAN, self.IMAGE, self.WHEELS]),
            "map": partial(Part, "map_server", writes=[self.MAP]),
            "eyes": partial(Part, "eyes", [self.SCAN, self.IMAGE], [self.OBSTACLES]),
            "pose": partial(Part, "estimator", [self.WHEELS], [self.POSE]),
            "planner": partial(Part, "planner", [self.MAP], serves="/plan"),
            "pilot": partial(
                Part,
                "pilot",
                [self.POSE, self.OBSTACLES],
                [self.VELOCITY],
                calls="/plan",
                goals=True,
            ),
            "motors": partial(Part, "motors", [self.VELOCITY], [("/motors/command", Twist)]),
        }


design = Robot()
