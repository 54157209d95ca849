# title: More sensors, filters, a logger, a display, diagnostics, namespaces, deadlines
# fails: nothing

from rclpy.duration import Duration

at_10_hz = QoSProfile(depth=5, deadline=Duration(seconds=0.2))
everything = QoSProfile(history=HistoryPolicy.KEEP_ALL)
latest = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)

design = course.Design(outside=["/motors/command", "/navigate_to", "/diagnostics"])
lidar = design.node("lidar", namespace="front")
lidar.publishes("/scan", LaserScan, at_10_hz).publishes("/diagnostics", DiagnosticArray)
design.node("camera", namespace="front").publishes("/camera/image", Image, latest)
design.node("wheels").publishes("/wheel/odometry", Odometry)
design.node("imu").publishes("imu/data", Imu, latest)
design.node("map_loader").publishes("/map", OccupancyGrid, 1).serves("reload_map", Trigger)

design.node("scan_filter").subscribes("scan", LaserScan, at_10_hz).publishes(
    "scan/filtered", LaserScan, at_10_hz
)
design.node("ekf").subscribes("wheel/odometry", Odometry).subscribes(
    "imu/data", Imu, latest
).publishes("pose", PoseStamped)
design.node("scan_obstacles").subscribes("scan/filtered", LaserScan, at_10_hz).publishes(
    "obstacles/near", PoseArray
)
design.node("image_obstacles").subscribes("camera/image", Image, latest).publishes(
    "obstacles/seen", PointCloud2
)
design.node("fusion").subscribes("obstacles/near", PoseArray).subscribes(
    "obstacles/seen", PointCloud2
).publishes("obstacles/all", PoseArray)

design.node("planner").subscribes("map", OccupancyGrid, 1).serves("plan", GetPlan)
design.node("navigator").action_server("navigate_to", NavigateTo).calls("plan", GetPlan).subscribes(
    "pose", PoseStamped
).subscribes("obstacles/all", PoseArray).publishes("velocity/wanted", Twist)
design.node("safety").subscribes("velocity/wanted", Twist).subscribes(
    "obstacles/near", PoseArray
).publishes("velocity/safe", Twist)
design.node("motor_controller").subscribes("velocity/safe", Twist, latest).publishes(
    "motors/command", Twist
)

logger = design.node("logger")
for topic, msg_type in (("pose", PoseStamped), ("velocity/wanted", Twist), ("scan", LaserScan)):
    logger.subscribes(topic, msg_type, everything)
design.node("display").subscribes("motors/command", Twist).subscribes("map", OccupancyGrid)
