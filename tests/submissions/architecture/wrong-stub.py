# title: The stub as it was handed out
# fails: drivers_publish, navigation_action, obstacle_information, pose_published, planner_service, motors_driven, links_connect
# says: links_connect: lidar_driver publishes /scan, but nobody reads it.
# in: the stub
