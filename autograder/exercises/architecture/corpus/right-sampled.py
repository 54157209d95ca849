# title: Nodes of its own that compute: twenty scans a second, the latest is looked at twice a second
# fails: nothing

from rclpy.node import Node


class Lidar(Node):
    def __init__(self):
        super().__init__("lidar_driver")
        self.scans = self.create_publisher(LaserScan, "scan", 10)
        self.create_timer(0.05, self.measure)

    def measure(self):
        scan = LaserScan(ranges=[2.0, 1.5, 3.0])
        scan.header.stamp = self.get_clock().now().to_msg()
        scan.header.frame_id = "lidar"
        self.scans.publish(scan)


class Detector(Node):
    """Publishes [distance, bearing] of the nearest obstacle."""

    def __init__(self):
        super().__init__("detector")
        self.latest = None
        self.found = self.create_publisher(Float32MultiArray, "obstacles", 10)
        self.create_subscription(LaserScan, "scan", self.keep, qos_profile_sensor_data)
        self.create_subscription(Image, "camera/image", lambda image: None, 10)
        self.create_timer(0.5, self.detect)

    def keep(self, scan):
        self.latest = scan

    def detect(self):
        if (scan := self.latest) is not None:
            distance = min(scan.ranges)
            beam = list(scan.ranges).index(distance)
            bearing = scan.angle_min + beam * scan.angle_increment
            found = Float32MultiArray(data=[distance, bearing])
            course.design.carry(scan, found)
            self.found.publish(found)


design = course.Design(outside=["motors/command", "navigate_to"])
design.node("lidar_driver", factory=Lidar)
design.node("camera_driver").publishes("camera/image", Image)
design.node("wheel_driver").publishes("wheel/odometry", Odometry)
design.node("map_server").publishes("map", OccupancyGrid)
design.node("estimator").subscribes("wheel/odometry", Odometry).publishes("pose", PoseStamped)
design.node("detector", factory=Detector)
design.node("planner").subscribes("map", OccupancyGrid).serves("plan", GetPlan)

(design.node("navigator")
    .action_server("navigate_to", NavigateTo)
    .subscribes("pose", PoseStamped)
    .subscribes("obstacles", Float32MultiArray)
    .calls("plan", GetPlan)
    .publishes("velocity", Twist))
design.node("controller").subscribes("velocity", Twist).publishes("motors/command", Twist)
