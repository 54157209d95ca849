# title: Nodes of one's own beside declared ones: a timer, a thread, inheritance and a function
# fails: nothing

import threading

from rclpy.action import ActionServer
from rclpy.node import Node


class Driver(Node):
    def __init__(self):
        super().__init__("lidar_driver")
        self.scans = self.create_publisher(LaserScan, "scan", qos_profile_sensor_data)
        self.create_timer(0.1, self.measure)

    def measure(self):
        scan = LaserScan()
        scan.header.frame_id = "lidar"
        scan.ranges = [1.0, 2.0, 3.0]
        self.scans.publish(scan)


class Detector(Node):
    def __init__(self):
        super().__init__("detector")
        self.found = self.create_publisher(PointStamped, "nearest", 10)
        self.create_subscription(LaserScan, "scan", self.look, qos_profile_sensor_data)
        self.create_subscription(Image, "camera/image", lambda msg: None, 10)

    def look(self, scan):
        nearest = PointStamped(header=scan.header)
        nearest.point.x = min(scan.ranges, default=0.0)
        self.found.publish(nearest)


class Navigator(Node):
    def __init__(self):
        super().__init__("navigator")
        self.velocity = self.create_publisher(Twist, "velocity", 10)
        self.planner = self.create_client(GetPlan, "plan")
        self.create_subscription(PoseStamped, "pose", lambda msg: None, 10)
        self.create_subscription(PointStamped, "nearest", self.tell, 10)
        self.server = ActionServer(self, NavigateTo, "navigate_to", self.drive)

    def tell(self, source):
        command = Twist()
        command.linear.x = 0.1
        course.design.carry(source, command)
        self.velocity.publish(command)

    async def drive(self, goal):
        self.tell(goal.request)
        goal.succeed()
        return NavigateTo.Result()


def make_controller():
    node = Node("controller")
    motors = node.create_publisher(Twist, "/motors/command", 10)

    def drive(command):
        threading.Thread(target=motors.publish, args=(command,)).start()

    node.create_subscription(Twist, "/velocity", drive, 10)
    return node


design = course.Design(outside=["motors/command", "navigate_to"])
design.node("lidar_driver", factory=Driver)
design.node("detector", factory=Detector)
design.node("navigator", factory=Navigator)
design.node("controller", factory=make_controller)
design.node("camera_driver").publishes("camera/image", Image)
design.node("wheel_driver").publishes("wheel/odometry", Odometry)
design.node("estimator").subscribes("wheel/odometry", Odometry).publishes("pose", PoseStamped)
design.node("map_server").publishes("map", OccupancyGrid)
design.node("planner").subscribes("map", OccupancyGrid).serves("plan", GetPlan)
