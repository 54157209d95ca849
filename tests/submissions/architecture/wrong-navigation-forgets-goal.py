# title: A navigation node that accepts goals and goes on as before
# fails: goal_reaches_motors
# says: goal_reaches_motors: It was seen on no topic

from rclpy.action import ActionServer
from rclpy.node import Node


class Navigation(Node):
    def __init__(self):
        super().__init__("navigation")
        self.velocity = self.create_publisher(Twist, "velocity", 10)
        self.planner = self.create_client(GetPlan, "plan_path")
        self.create_subscription(PoseArray, "obstacles", self.avoid, 10)
        self.create_subscription(PoseStamped, "pose", lambda msg: None, 10)
        self.server = ActionServer(self, NavigateTo, "navigate_to", self.navigate)

    def avoid(self, obstacles):
        command = Twist()
        course.design.carry(obstacles, command)
        self.velocity.publish(command)

    def navigate(self, goal):
        goal.succeed()
        return NavigateTo.Result()


design = course.Design(outside=["motors/command", "navigate_to"])
design.node("lidar_driver").publishes("scan", LaserScan)
design.node("camera_driver").publishes("camera/image", Image)
design.node("wheel_driver").publishes("wheel/odometry", Odometry)
design.node("map_server").publishes("map", OccupancyGrid)
design.node("state_estimation").subscribes("wheel/odometry", Odometry).publishes("pose", PoseStamped)
design.node("obstacle_detection").subscribes("scan", LaserScan).subscribes(
    "camera/image", Image
).publishes("obstacles", PoseArray)
design.node("path_planner").subscribes("map", OccupancyGrid).serves("plan_path", GetPlan)
design.node("navigation", factory=Navigation)
design.node("controller").subscribes("velocity", Twist).publishes("motors/command", Twist)
