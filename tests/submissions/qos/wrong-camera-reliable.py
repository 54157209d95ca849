# title: A camera that re-sends lost frames
# fails: camera_best_effort, camera_moves_on
# in: the stub

camera_qos = QoSProfile(depth=5)
lidar_qos = QoSProfile(depth=1)
imu_qos = QoSProfile(depth=10)
stop_qos = QoSProfile(history=HistoryPolicy.KEEP_ALL)
