# title: Old scans for whoever starts late
# fails: late_joiner
# says: late_joiner: It was handed lidar readings from before it started.
# in: the stub

camera_qos = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)
lidar_qos = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
imu_qos = QoSProfile(depth=10)
stop_qos = QoSProfile(history=HistoryPolicy.KEEP_ALL)
