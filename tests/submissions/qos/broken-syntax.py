# title: A cell that is not Python
# fails: nodes_start

camera_qos = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT
