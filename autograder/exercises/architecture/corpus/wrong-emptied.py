# title: One node without a single endpoint
# fails: drivers_publish, navigation_action, obstacle_information, pose_published, planner_service, motors_driven, links_connect
# says: drivers_publish: Nobody publishes on /scan.
# says: links_connect: No topic leads from one node to another.
# points: 0

design = course.Design(outside=['motors/command', 'navigate_to'])
design.node('robot')
