# title: Obstacle avoidance that works through old scans
# fails: lidar_fresh
# says: lidar_fresh: It then worked through the last
# in: the stub

camera_qos = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)
lidar_qos = QoSProfile(depth=20)
imu_qos = QoSProfile(depth=10)
stop_qos = QoSProfile(history=HistoryPolicy.KEEP_ALL)
