# title: Stop events that expire while they wait
# fails: stop_complete, stop_repaired
# says: stop_complete: A lifespan on emergency/stop throws events away when they get old.
# says: stop_repaired: of 100 were lost
# in: the stub

from rclpy.duration import Duration

camera_qos = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)
lidar_qos = QoSProfile(depth=1)
imu_qos = QoSProfile(depth=10)
stop_qos = QoSProfile(history=HistoryPolicy.KEEP_ALL, lifespan=Duration(nanoseconds=1_000_000))
