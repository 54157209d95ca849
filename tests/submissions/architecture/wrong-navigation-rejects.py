# title: A navigation node that rejects every goal
# fails: goal_reaches_motors
# says: goal_reaches_motors: The server of /navigate_to rejected each of 8 goals

from rclpy.action import ActionServer, GoalResponse
from rclpy.node import Node


class Nav(Node):
    def __init__(self):
        super().__init__("nav")
        self.v = self.create_publisher(Twist, "velocity", 10)
        self.c = self.create_client(GetPlan, "plan")
        self.create_subscription(PoseStamped, "pose", lambda m: None, 10)
        self.create_subscription(PoseArray, "obstacles", self.o, 10)
        self.s = ActionServer(
            self, NavigateTo, "navigate_to", self.e, goal_callback=lambda g: GoalResponse.REJECT
        )

    def o(self, m):
        t = Twist()
        course.design.carry(m, t)
        self.v.publish(t)

    def e(self, g):
        raise RuntimeError


design = course.Design()
design.node("lidar_driver").publishes("scan", LaserScan)
design.node("camera_driver").publishes("camera/image", Image)
design.node("wheel_driver").publishes("wheel/odometry", Odometry)
design.node("map_server").publishes("map", OccupancyGrid)
design.node("est").subscribes("wheel/odometry", Odometry).publishes("pose", PoseStamped)
design.node("det").subscribes("scan", LaserScan).subscribes("camera/image", Image).publishes(
    "obstacles", PoseArray
)
design.node("planner").subscribes("map", OccupancyGrid).serves("plan", GetPlan)
design.node("nav").action_server("navigate_to", NavigateTo).subscribes(
    "obstacles", PoseArray
).subscribes("pose", PoseStamped).calls("plan", GetPlan).publishes("velocity", Twist)

design.nodes["nav"].factory = Nav
design.node("controller").subscribes("velocity", Twist).publishes("motors/command", Twist)
