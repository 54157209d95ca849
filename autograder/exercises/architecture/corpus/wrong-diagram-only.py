# title: Nodes on the graph, without a link
# fails: drivers_publish, navigation_action, obstacle_information, pose_published, planner_service, motors_driven, links_connect
# says: drivers_publish: Nobody publishes on /scan.
# says: navigation_action: No node is its server.
# says: obstacle_information: No node subscribes to /scan or /camera/image.
# says: pose_published: No node publishes a topic with a pose type.
# says: planner_service: No node reads /map.
# says: motors_driven: Nobody publishes on /motors/command.
# says: links_connect: No topic leads from one node to another.

design = course.Design()
for name in ("drivers", "obstacle_detection", "path_planner", "navigation", "controller"):
    design.node(name)
