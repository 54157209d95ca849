# title: One hidden node does everything, behind facades that do nothing
# reaches: the exam
# exercise: architecture
# base: wrong-emptied
# told: _god and controller both command the motors
# score: 10

from rclpy.node import Node
from rclpy.action import ActionServer
from rclpy.callback_groups import ReentrantCallbackGroup
from course.design import message_tags
from geometry_msgs.msg import PoseStamped, Twist
RUNNING = []

class God(Node):
    """Does everything; tools do not list names that begin with an underscore."""
    def __init__(self):
        super().__init__("_god", start_parameter_services=False, enable_rosout=False)
        self.motors = self.create_publisher(Twist, "motors/command", 10)
        self.cmd = self.create_publisher(Twist, "cmd_vel", 10)
        self.obst = self.create_publisher(PoseArray, "obstacles", 10)
        self.pose = self.create_publisher(PoseStamped, "pose", 10)
        self.create_subscription(LaserScan, "scan", lambda m: self.on(m, self.obst, self.cmd, self.motors), 10)
        self.create_subscription(PoseArray, "obstacles", lambda m: self.on(m, self.cmd, self.motors), 10)
        self.create_subscription(Odometry, "wheel/odometry", lambda m: self.on(m, self.pose), 10)
    def on(self, got, *out):
        tags = message_tags.read_all(got)
        for p in out:
            self.say(p, tags)
    def say(self, p, tags):
        made = p.msg_type()
        if isinstance(made, PoseArray): made.poses = [__import__("geometry_msgs.msg").msg.Pose()]
        if tags: message_tags.mark(made, *tags)
        p.publish(made)

class Facade(Node):
    def __init__(self, name, pubs=(), subs=(), god=False):
        super().__init__(name)
        for topic, kind in pubs: self.create_publisher(kind, topic, 10)
        for topic, kind in subs: self.create_subscription(kind, topic, lambda m: None, 10)

class Planner(Facade):
    def __init__(self):
        super().__init__("path_planner", subs=[("map", OccupancyGrid), ("goal", PoseStamped)])
        self.create_service(GetPlan, "plan", lambda q, r: r)

class Navigator(Facade):
    def __init__(self):
        super().__init__("navigation", pubs=[("goal", PoseStamped)], subs=[("obstacles", PoseArray), ("pose", PoseStamped)])
        self.create_publisher(Twist, "cmd_vel", 10)
        self.create_client(GetPlan, "plan")
        self.god = God()
        from course import session as _s
        import threading
        from rclpy.executors import SingleThreadedExecutor
        ex = SingleThreadedExecutor(context=self.context); ex.add_node(self.god)
        threading.Thread(target=ex.spin, daemon=True).start(); RUNNING.append(ex)
        ActionServer(self, NavigateTo, "navigate_to", self.go, callback_group=ReentrantCallbackGroup())
    def go(self, handle):
        tags = message_tags.read_all(handle.request)
        self.god.say(self.god.cmd, tags); self.god.say(self.god.motors, tags)
        handle.succeed()
        return NavigateTo.Result()

class _Design:
    def node_factories(self):
        return {
            "lidar": lambda: Facade("lidar_driver", pubs=[("scan", LaserScan)]),
            "camera": lambda: Facade("camera_driver", pubs=[("camera/image", Image)]),
            "wheels": lambda: Facade("wheel_driver", pubs=[("wheel/odometry", Odometry)]),
            "map": lambda: Facade("map_server", pubs=[("map", OccupancyGrid)]),
            "state": lambda: Facade("state_estimation", pubs=[("pose", PoseStamped)], subs=[("wheel/odometry", Odometry)]),
            "detect": lambda: Facade("obstacle_detection", pubs=[("obstacles", PoseArray)], subs=[("scan", LaserScan), ("camera/image", Image)]),
            "plan": Planner, "nav": Navigator,
            "control": lambda: Facade("controller", pubs=[("motors/command", Twist)], subs=[("cmd_vel", Twist)]),
        }
design = _Design()
