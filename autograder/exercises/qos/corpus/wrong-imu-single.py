# title: An IMU queue that drops the burst
# fails: imu_burst
# says: imu_burst: that had waited longest were lost
# in: the stub

camera_qos = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)
lidar_qos = QoSProfile(depth=1)
imu_qos = QoSProfile(depth=1)
stop_qos = QoSProfile(history=HistoryPolicy.KEEP_ALL)
