# title: An IMU queue without an end
# fails: imu_burst
# says: imu_burst: It then worked through the last
# in: the stub

camera_qos = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)
lidar_qos = QoSProfile(depth=1)
imu_qos = QoSProfile(history=HistoryPolicy.KEEP_ALL)
stop_qos = QoSProfile(history=HistoryPolicy.KEEP_ALL)
