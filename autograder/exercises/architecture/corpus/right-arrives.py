# title: A navigator of its own that drives until the pose is at the waypoint, and then stands
# fails: nothing

from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node
from rclpy.task import Future


class Navigator(Node):
    """Drives while the waypoint is more than 20 cm away."""

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
            cancel_callback=lambda goal: CancelResponse.ACCEPT,
            callback_group=group,
        )
        self.create_timer(0.1, self.step, callback_group=group)

    def decide(self, goal):
        return GoalResponse.ACCEPT

    def avoid(self, obstacles):
        if self.goals:  # without a goal the robot stands
            command = Twist()
            course.design.carry(obstacles, command)
            self.velocity.publish(command)

    async def drive(self, goal):
        entry = (goal, Future())
        for _, ended in self.goals:
            ended.set_result(False)  # the newest goal counts
        self.goals = [entry]
        arrived = await entry[1]
        if goal.is_cancel_requested:
            goal.canceled()
        elif arrived:
            goal.succeed()
        else:
            goal.abort()
        return NavigateTo.Result(arrived=arrived)

    def step(self):
        """Ten times a second: drive on, or arrive."""
        for goal, ended in list(self.goals):
            where = goal.request.waypoint.pose.position  # the pose is at the origin: nothing moves
            if goal.is_cancel_requested or (where.x**2 + where.y**2) ** 0.5 < 0.2:
                self.goals = []
                ended.set_result(not goal.is_cancel_requested)
                return
            command = Twist()
            course.design.carry(goal.request, command)
            self.velocity.publish(command)


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
