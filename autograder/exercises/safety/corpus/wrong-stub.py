# title: the stub as it is released
# fails: the first
# says: gripper_answers: the gripper was not called. It said nothing
# says: speed_serves: It was answered successful=False
# says: goals_end: the navigator got no goal
# says: drive_arrives: A goal of 0 m is rejected
# points: 0
# in: the stub

