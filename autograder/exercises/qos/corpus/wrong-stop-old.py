# title: Stop events that are forgotten after five seconds
# fails: stop_complete
# says: stop_complete: A lifespan on emergency/stop throws events away when they get old.
# in: the stub

from rclpy.duration import Duration

camera_qos = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)
lidar_qos = QoSProfile(depth=1)
imu_qos = QoSProfile(depth=10)
stop_qos = QoSProfile(history=HistoryPolicy.KEEP_ALL, lifespan=Duration(seconds=5))
