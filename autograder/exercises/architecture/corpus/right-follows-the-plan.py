# title: A navigator of its own that awaits the plan and publishes it; the planner knows the pose, too
# fails: nothing

from rclpy.action import ActionServer
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node


class Navigator(Node):
    """Asks the planner with the goal, and hands on the path that comes back."""

    def __init__(self):
        super().__init__("navigator")
        group = ReentrantCallbackGroup()
        self.path = self.create_publisher(Path, "path", 10)
        self.planner = self.create_client(GetPlan, "plan", callback_group=group)
        self.create_subscription(PoseStamped, "pose", lambda msg: None, 10, callback_group=group)
        self.server = ActionServer(
            self, NavigateTo, "navigate_to", self.drive, callback_group=group
        )

    async def drive(self, goal):
        request = GetPlan.Request()
        course.design.carry(goal.request, request)
        answer = await self.planner.call_async(request)
        path = Path()
        course.design.carry(answer, path)
        self.path.publish(path)
        goal.succeed()
        return NavigateTo.Result()


design = course.Design(outside=["motors/command", "navigate_to"])
design.node("lidar_driver").publishes("scan", LaserScan)
design.node("camera_driver").publishes("camera/image", Image)
design.node("wheel_driver").publishes("wheel/odometry", Odometry)
design.node("map_server").publishes("map", OccupancyGrid)
design.node("estimator").subscribes("wheel/odometry", Odometry).publishes("pose", PoseStamped)
design.node("detector").subscribes("scan", LaserScan).subscribes("camera/image", Image).publishes(
    "obstacles", PoseArray
)
design.node("planner").subscribes("map", OccupancyGrid).subscribes("pose", PoseStamped).subscribes(
    "obstacles", PoseArray
).serves("plan", GetPlan)
design.node("navigator", factory=Navigator)
design.node("controller").subscribes("path", Path).subscribes("obstacles", PoseArray).publishes(
    "motors/command", Twist
)
