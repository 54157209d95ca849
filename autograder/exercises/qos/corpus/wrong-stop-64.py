# title: A stop queue that is deep, but not deep enough
# fails: stop_complete, stop_repaired
# says: stop_complete: of 100 were lost: the consumer handled
# says: stop_repaired: of 100 were lost: it got
# in: the stub

camera_qos = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)
lidar_qos = QoSProfile(depth=1)
imu_qos = QoSProfile(depth=10)
stop_qos = QoSProfile(depth=64)
