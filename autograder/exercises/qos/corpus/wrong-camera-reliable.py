# title: A camera that re-sends lost frames
# fails: camera_best_effort, camera_moves_on
# says: camera_best_effort: The driver offers RELIABLE and the consumer requests it, so DDS re-sends.
# says: camera_moves_on: frames that were lost in the gap were sent again before it.
# in: the stub

camera_qos = QoSProfile(depth=5)
lidar_qos = QoSProfile(depth=1)
imu_qos = QoSProfile(depth=10)
stop_qos = QoSProfile(history=HistoryPolicy.KEEP_ALL)
