# title: KEEP_LAST without a depth, which rclpy refuses
# fails: nodes_start
# says: nodes_start: No SensorDrivers was defined: did its cell end with an error? The last error of a cell was InvalidQoSProfile
# in: the stub

camera_qos = QoSProfile(
    history=HistoryPolicy.KEEP_LAST, reliability=ReliabilityPolicy.BEST_EFFORT
)
