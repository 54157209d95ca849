# title: One node that reads what it publishes itself, and orders the motors about: nothing dangles
# fails: drivers_publish, navigation_action, obstacle_information, pose_published, planner_service, motors_driven, links_connect
# says: motors_driven: nothing leads there from the server
# says: links_connect: No topic leads from one node to another.
# points: 0

design = course.Design(outside=['motors/command', 'navigate_to'])
(design.node('lidar_driver')
    .publishes('scan', LaserScan)
    .subscribes('scan', LaserScan)
    .publishes('motors/command', Twist))
