# title: The camera finds obstacles, the planner owns the map, the pose comes from an inertial sensor
# fails: nothing

from geometry_msgs.msg import TwistWithCovarianceStamped

latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)

design = course.Design(outside=["motors/command", "navigate_to"])
design.node("lidar").publishes("scan", LaserScan)
design.node("camera").publishes("camera/image", Image)
design.node("encoders").publishes("wheel/odometry", Odometry)
design.node("imu_driver").publishes("imu/data", Imu, qos_profile_sensor_data)
design.node("wheel_speeds").subscribes("wheel/odometry", Odometry).publishes(
    "wheel/twist", TwistWithCovarianceStamped
)
design.node("ekf").subscribes("imu/data", Imu, qos_profile_sensor_data).subscribes(
    "wheel/twist", TwistWithCovarianceStamped
).publishes("odometry/filtered", Odometry)
design.node("planner").publishes("map", OccupancyGrid, latched).serves("plan", GetPlan)
design.node("display").subscribes("scan", LaserScan).subscribes("map", OccupancyGrid, latched)
design.node("vision").subscribes("camera/image", Image).publishes("obstacles", PoseArray)
design.node("navigation").action_server("navigate_to", NavigateTo).subscribes(
    "odometry/filtered", Odometry
).subscribes("obstacles", PoseArray).calls("plan", GetPlan).publishes("velocity", Twist)
design.node("control").subscribes("velocity", Twist).publishes("motors/command", Twist)
