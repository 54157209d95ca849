# title: A navigator of its own that waits for the planner in the callback that keeps the answer out
# fails: goal_reaches_motors
# says: goal_reaches_motors: It was seen on no topic

from rclpy.action import ActionServer
from rclpy.node import Node


class Navigator(Node):
    def __init__(self):
        super().__init__("navigator")
        self.velocity = self.create_publisher(Twist, "velocity", 10)
        self.planner = self.create_client(GetPlan, "plan")
        self.create_subscription(PoseStamped, "pose", lambda msg: None, 10)
        self.server = ActionServer(
            self, NavigateTo, "navigate_to", self.drive, handle_accepted_callback=self.plan
        )

    def plan(self, goal):
        """Runs in the node's one callback group, as the planner's answer would have to."""
        self.path = self.planner.call(GetPlan.Request()).plan
        goal.execute()

    def drive(self, goal):
        command = Twist()
        course.design.carry(goal.request, command)
        self.velocity.publish(command)
        goal.succeed()
        return NavigateTo.Result(message=f"{len(self.path.poses)} poses")


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
design.node("controller").subscribes("velocity", Twist).subscribes(
    "obstacles", PoseArray
).publishes("motors/command", Twist)
