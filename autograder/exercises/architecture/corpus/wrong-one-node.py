# title: One node that does everything
# fails: obstacle_information, pose_published, planner_service, links_connect
# says: obstacle_information: Only robot reads /scan or /camera/image
# says: pose_published: /pose comes from robot, the navigation node.
# says: planner_service: robot serves /plan_path, but no other node calls it.
# says: links_connect: No topic leads from one node to another.

design = course.Design(outside=["motors/command", "navigate_to"])
robot = design.node("robot")
for topic, msg_type in (
    ("scan", LaserScan),
    ("camera/image", Image),
    ("wheel/odometry", Odometry),
    ("map", OccupancyGrid),
    ("pose", PoseStamped),
    ("obstacles", PoseArray),
):
    robot.publishes(topic, msg_type).subscribes(topic, msg_type)
robot.action_server("navigate_to", NavigateTo)
robot.serves("plan_path", GetPlan).calls("plan_path", GetPlan)
robot.publishes("motors/command", Twist)
