# title: In the manner of Nav2: a costmap, the controller as an action server, the map as a service
# fails: nothing

from test_msgs.action import Fibonacci

latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
sensors = qos_profile_sensor_data

design = course.Design(outside=["motors/command"])
design.node("robot_base").publishes("scan", LaserScan, sensors).publishes(
    "camera/image", Image, sensors
).publishes("wheel/odometry", Odometry, sensors)
design.node("map_server").serves("map/get", GetMap).publishes("map", OccupancyGrid, latched)
design.node("amcl").subscribes("scan", LaserScan, sensors).subscribes(
    "map", OccupancyGrid, latched
).subscribes("wheel/odometry", Odometry, sensors).publishes("amcl_pose", PoseWithCovarianceStamped)
design.node("costmap").subscribes("scan", LaserScan, sensors).subscribes(
    "camera/image", Image, sensors
).calls("map/get", GetMap).publishes("costmap", OccupancyGrid, latched)
design.node("planner_server").calls("map/get", GetMap).subscribes(
    "costmap", OccupancyGrid, latched
).serves("compute_path", GetPlan)
design.node("bt_navigator").action_server("navigate_to", NavigateTo).subscribes(
    "amcl_pose", PoseWithCovarianceStamped
).calls("compute_path", GetPlan).action_client("follow_path", Fibonacci)
design.node("controller_server").action_server("follow_path", Fibonacci).subscribes(
    "costmap", OccupancyGrid, latched
).subscribes("wheel/odometry", Odometry, sensors).publishes("motors/command", Twist)
design.node("mission").action_client("navigate_to", NavigateTo)
