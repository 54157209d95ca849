# title: The stub as it was handed out
# fails: drivers_publish, navigation_action, obstacle_information, pose_published, planner_service, motors_driven, links_connect
# says: drivers_publish: Nobody publishes on /camera/image.
# says: navigation_action: No node is its server.
# says: obstacle_information: No node subscribes to /scan or /camera/image.
# says: pose_published: No node publishes a topic with a pose type.
# says: planner_service: No node reads /map.
# says: motors_driven: Nobody publishes on /motors/command.
# says: links_connect: lidar_driver publishes /scan, but nobody reads it.
# points: 0
# in: the stub
