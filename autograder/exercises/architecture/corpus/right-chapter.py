# title: The chapter's answer, without a word about QoS
# fails: nothing

design = course.Design(outside=["motors/command", "navigate_to"])
design.node("lidar_driver").publishes("scan", LaserScan)
design.node("camera_driver").publishes("camera/image", Image)
design.node("wheel_driver").publishes("wheel/odometry", Odometry)
design.node("map_server").publishes("map", OccupancyGrid)
design.node("state_estimation").subscribes("wheel/odometry", Odometry).publishes("pose", PoseStamped)
design.node("obstacle_detection").subscribes("scan", LaserScan).subscribes(
    "camera/image", Image
).publishes("obstacles", PointCloud2)
design.node("path_planner").subscribes("map", OccupancyGrid).subscribes(
    "goal", PoseStamped
).serves("plan", GetPlan)
design.node("navigation").action_server("navigate_to", NavigateTo).subscribes(
    "scan", LaserScan
).subscribes("obstacles", PointCloud2).subscribes("pose", PoseStamped).publishes(
    "goal", PoseStamped
).calls("plan", GetPlan).publishes("cmd_vel", Twist)
design.node("controller").subscribes("cmd_vel", Twist).publishes("motors/command", Twist)
