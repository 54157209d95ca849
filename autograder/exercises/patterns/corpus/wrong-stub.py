# title: The stub as it was handed out: everything is a topic
# fails: choices_made, camera_streams, position_answered, parameter_changes, battery_broadcast, navigation_drives
# says: choices_made: position is still open
# says: navigation_drives: On the ROS graph robot/navigate is a topic. The sender
# says: parameter_changes: would never hear whether it holds
# says: camera_streams: They came at 0.5 a second
# says: battery_broadcast: 1 s after the level had become
# says: position_answered: With the robot at 0.3 m, no message came
# points: 0
# in: the stub
