# title: Queues without an end whose readings expire instead
# fails: nothing
# in: the stub

from rclpy.duration import Duration


def fresh(seconds, reliability=ReliabilityPolicy.RELIABLE):
    return QoSProfile(
        history=HistoryPolicy.KEEP_ALL,
        reliability=reliability,
        lifespan=Duration(seconds=seconds),
    )


camera_qos = fresh(1.0, ReliabilityPolicy.BEST_EFFORT)
lidar_qos = fresh(0.5)
imu_qos = fresh(0.5)
stop_qos = QoSProfile(history=HistoryPolicy.KEEP_ALL)
