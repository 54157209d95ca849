# title: An estimator that needs the IMU, a planner that needs the map, and a navigator that takes no goal without a pose
# fails: nothing

import math

from rclpy.action import ActionServer, GoalResponse
from rclpy.node import Node


class Estimator(Node):
    def __init__(self):
        super().__init__("state_estimation")
        self.yaw = None
        self.poses = self.create_publisher(PoseStamped, "pose", 10)
        self.create_subscription(Imu, "imu", self.turn, qos_profile_sensor_data)
        self.create_subscription(Odometry, "wheel/odometry", self.move, 10)

    def turn(self, imu):
        self.yaw = math.atan2(imu.orientation.z, imu.orientation.w) * 2

    def move(self, wheels):
        if self.yaw is not None:
            pose = PoseStamped(header=wheels.header)
            pose.pose.position = wheels.pose.pose.position
            pose.pose.orientation.z = math.sin(self.yaw / 2)
            pose.pose.orientation.w = math.cos(self.yaw / 2)
            self.poses.publish(pose)


class Planner(Node):
    """Goes straight, if both ends are on free cells of the map."""

    def __init__(self):
        super().__init__("planner")
        self.map = None
        self.create_subscription(OccupancyGrid, "map", self.learn, latched)
        self.create_service(GetPlan, "plan", self.plan)

    def learn(self, grid):
        self.map = grid

    def free(self, pose):
        info = self.map.info
        column = int((pose.pose.position.x - info.origin.position.x) / info.resolution)
        row = int((pose.pose.position.y - info.origin.position.y) / info.resolution)
        inside = 0 <= column < info.width and 0 <= row < info.height
        return inside and self.map.data[row * info.width + column] < 50

    def plan(self, request, response):
        if self.map is not None and self.free(request.start) and self.free(request.goal):
            response.plan.header = request.goal.header
            response.plan.poses = [request.start, request.goal]
        return response


class Navigator(Node):
    def __init__(self):
        super().__init__("navigation")
        self.pose = None
        self.velocity = self.create_publisher(Twist, "velocity", 10)
        self.planner = self.create_client(GetPlan, "plan")
        self.create_subscription(PoseStamped, "pose", self.locate, 10)
        self.server = ActionServer(
            self, NavigateTo, "navigate_to", self.drive, goal_callback=self.consider
        )

    def locate(self, pose):
        self.pose = pose

    def consider(self, request):
        return GoalResponse.REJECT if self.pose is None else GoalResponse.ACCEPT

    async def drive(self, goal):
        request = GetPlan.Request(start=self.pose, goal=goal.request.waypoint)
        plan = (await self.planner.call_async(request)).plan
        if not plan.poses:
            goal.abort()
            return NavigateTo.Result(message="there is no way")
        command = Twist()
        course.design.carry(plan, command)
        self.velocity.publish(command)
        goal.succeed()
        return NavigateTo.Result(arrived=True)


latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
design = course.Design(outside=["motors/command", "navigate_to"])
design.node("lidar_driver").publishes("scan", LaserScan)
design.node("camera_driver").publishes("camera/image", Image)
design.node("wheel_driver").publishes("wheel/odometry", Odometry)
design.node("imu_driver").publishes("imu", Imu, qos_profile_sensor_data)
design.node("map_server").publishes("map", OccupancyGrid, latched)
design.node("state_estimation", factory=Estimator)
design.node("detector").subscribes("scan", LaserScan).subscribes("camera/image", Image).publishes(
    "obstacles", PoseArray
)
design.node("planner", factory=Planner)
design.node("navigation", factory=Navigator)
design.node("controller").subscribes("velocity", Twist).subscribes("obstacles", PoseArray).publishes(
    "motors/command", Twist
)
