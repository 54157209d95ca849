# title: A navigator whose execute callback publishes feedback and sleeps, as in the ROS 2 action tutorial
# fails: nothing

import time

from rclpy.action import ActionServer
from rclpy.node import Node


class Navigator(Node):
    def __init__(self):
        super().__init__("navigator")
        self.velocity = self.create_publisher(Twist, "velocity", 10)
        self.planner = self.create_client(GetPlan, "plan")
        self.create_subscription(PoseStamped, "pose", lambda msg: None, 10)
        self.create_subscription(PoseArray, "obstacles", self.steer, 10)
        self.server = ActionServer(self, NavigateTo, "navigate_to", self.drive)

    def steer(self, source):
        command = Twist()
        course.design.carry(source, command)
        self.velocity.publish(command)

    def drive(self, goal):
        for left in range(10, 0, -1):
            self.steer(goal.request)
            goal.publish_feedback(NavigateTo.Feedback(distance_left=float(left)))
            time.sleep(1)
        goal.succeed()
        return NavigateTo.Result(arrived=True)


design = course.Design(outside=["motors/command", "navigate_to"])
design.node("lidar_driver").publishes("scan", LaserScan)
design.node("camera_driver").publishes("camera/image", Image)
design.node("wheel_driver").publishes("wheel/odometry", Odometry)
design.node("map_server").publishes("map", OccupancyGrid)
design.node("estimator").subscribes("wheel/odometry", Odometry).publishes("pose", PoseStamped)
design.node("detector").subscribes("scan", LaserScan).subscribes("camera/image", Image).publishes(
    "obstacles", PoseArray
)
design.node("planner").subscribes("map", OccupancyGrid).serves("plan", GetPlan)
design.node("navigator", factory=Navigator)
design.node("controller").subscribes("velocity", Twist).publishes("motors/command", Twist)
