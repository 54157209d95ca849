# title: Few nodes: drivers in one, perception in one, navigation drives the motors itself
# fails: nothing

design = course.Design(outside=["motors/command", "navigate_to"])
sensors = [("scan", LaserScan), ("camera/image", Image), ("wheel/odometry", Odometry)]

drivers = design.node("drivers")
perception = design.node("perception")
for topic, msg_type in sensors:
    drivers.publishes(topic, msg_type, qos_profile_sensor_data)
    perception.subscribes(topic, msg_type, qos_profile_sensor_data)
perception.publishes("obstacles", Float32MultiArray).publishes("pose", PoseStamped)

planner = design.node("planner")
planner.publishes("map", OccupancyGrid).subscribes("map", OccupancyGrid)
planner.serves("plan", GetPlan)

pilot = design.node("pilot")
pilot.action_server("navigate_to", NavigateTo).calls("plan", GetPlan)
pilot.subscribes("obstacles", Float32MultiArray).subscribes("pose", PoseStamped)
pilot.publishes("motors/command", Twist)
