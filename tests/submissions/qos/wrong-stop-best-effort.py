# title: A stop that may get lost
# fails: stop_reaches_all
# in: the stub

camera_qos = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)
lidar_qos = QoSProfile(depth=1)
imu_qos = QoSProfile(depth=10)
stop_qos = QoSProfile(history=HistoryPolicy.KEEP_ALL, reliability=ReliabilityPolicy.BEST_EFFORT)
