# title: A navigator of its own that drives to one waypoint after the other, cannot be cancelled
# fails: nothing

from rclpy.action import ActionServer, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node
from rclpy.task import Future


class Navigator(Node):
    """Waypoints wait in line; each takes twelve seconds."""

    def __init__(self):
        super().__init__("navigator")
        group = ReentrantCallbackGroup()
        self.velocity = self.create_publisher(Twist, "velocity", 10)
        self.planner = self.create_client(GetPlan, "plan", callback_group=group)
        self.create_subscription(PoseStamped, "pose", lambda msg: None, 10, callback_group=group)
        self.create_subscription(PoseArray, "obstacles", self.avoid, 10, callback_group=group)
        self.goals = []  # the first is the one that the robot drives to
        self.server = ActionServer(
            self,
            NavigateTo,
            "navigate_to",
            self.drive,
            goal_callback=self.decide,
            callback_group=group,
        )
        self.create_timer(0.1, self.step, callback_group=group)

    def decide(self, goal):
        return GoalResponse.ACCEPT

    def avoid(self, obstacles):
        command = Twist()
        course.design.carry(obstacles, command)
        self.velocity.publish(command)

    async def drive(self, goal):
        """Wait, without blocking anyone, until `step` says how it ended."""
        entry = [goal, 0, Future()]
        self.goals.append(entry)
        await entry[2]
        self.goals.remove(entry)
        goal.succeed()
        return NavigateTo.Result(arrived=True)

    def step(self):
        """Ten times a second: drive on to the first goal."""
        if not self.goals:
            return
        goal, steps, ended = entry = self.goals[0]
        entry[1] = steps + 1
        if entry[1] >= 120 and not ended.done():
            ended.set_result(None)
        command = Twist()
        course.design.carry(goal.request, command)
        self.velocity.publish(command)
        goal.publish_feedback(NavigateTo.Feedback(distance_left=float(120 - steps)))


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
