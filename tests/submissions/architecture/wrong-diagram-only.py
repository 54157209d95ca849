# title: Nodes on the graph, without a link
# fails: drivers_publish, navigation_action, obstacle_information, pose_published, planner_service, motors_driven, links_connect
# says: links_connect: No topic connects anything.

design = course.Design()
for name in ("drivers", "obstacle_detection", "path_planner", "navigation", "controller"):
    design.node(name)
