# title: The goal on a topic, and a controller that asks the planner for the next waypoint
# fails: nothing

design = course.Design(outside=["motors/command", "navigate_to"])
design.node("drv").publishes("scan", LaserScan).publishes("camera/image", Image).publishes(
    "wheel/odometry", Odometry
)
design.node("maps").publishes("map", OccupancyGrid)
design.node("est").subscribes("wheel/odometry", Odometry).publishes("pose", PoseStamped)
design.node("det").subscribes("scan", LaserScan).subscribes("camera/image", Image).publishes(
    "obstacles", String
)
design.node("nav").action_server("navigate_to", NavigateTo).subscribes(
    "pose", PoseStamped
).publishes("goal", PoseStamped)
design.node("planner").subscribes("map", OccupancyGrid).subscribes("goal", PoseStamped).serves(
    "next_waypoint", Trigger
)
design.node("ctl").subscribes("obstacles", String).calls("next_waypoint", Trigger).publishes(
    "motors/command", Twist
)
for n in range(5):
    design.node(f"logger_{n}").subscribes("pose", PoseStamped).subscribes("scan", LaserScan)
