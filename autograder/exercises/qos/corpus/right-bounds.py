# title: The largest queues that the task allows
# fails: nothing
# in: the stub

camera_qos = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
lidar_qos = QoSProfile(depth=5)
imu_qos = QoSProfile(depth=50)
stop_qos = QoSProfile(depth=100)
