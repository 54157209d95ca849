# title: A controller that invents evidence instead of listening
# fails: goal_reaches_motors, scan_reaches_motors

import random

from rclpy.node import Node


class Controller(Node):
    def __init__(self):
        super().__init__("controller")
        self.motors = self.create_publisher(Twist, "motors/command", 10)
        self.create_subscription(Twist, "velocity", lambda msg: None, 10)
        self.create_timer(0.005, self.invent)

    def invent(self):
        command = Twist()
        command.linear.x = float(random.randrange(2**20, 2**24))
        self.motors.publish(command)


design = course.Design.from_data(
    {
        "lidar_driver": {"publishes": [["scan", LaserScan]]},
        "camera_driver": {"publishes": [["camera/image", Image]]},
        "wheel_driver": {"publishes": [["wheel/odometry", Odometry]]},
        "map_server": {"publishes": [["map", OccupancyGrid]]},
        "state_estimation": {
            "subscribes": [["wheel/odometry", Odometry]],
            "publishes": [["pose", PoseStamped]],
        },
        "obstacle_detection": {
            "subscribes": [["scan", LaserScan], ["camera/image", Image]],
            "publishes": [["obstacles", PoseArray]],
        },
        "path_planner": {
            "subscribes": [["map", OccupancyGrid]],
            "serves": [["plan_path", GetPlan]],
        },
        "navigation": {
            "action_server": [["navigate_to", NavigateTo]],
            "subscribes": [["obstacles", PoseArray], ["pose", PoseStamped]],
            "calls": [["plan_path", GetPlan]],
            "publishes": [["velocity", Twist]],
        },
    }
)
design.node("controller", factory=Controller)
