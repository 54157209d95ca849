# title: Drivers offer much, each consumer asks for what it needs
# fails: nothing

offered = QoSProfile(depth=10)
events = QoSProfile(history=HistoryPolicy.KEEP_ALL)


def latest(depth):
    return QoSProfile(depth=depth, reliability=ReliabilityPolicy.BEST_EFFORT)


class SensorDrivers(Relay):
    def __init__(self):
        super().__init__("sensor_drivers")
        for msg_type, name, topic in (
            (Image, "camera", "camera/image"),
            (LaserScan, "lidar", "scan"),
            (Imu, "imu", "imu/data"),
        ):
            self.relay(msg_type, f"hardware/{name}", topic, target_qos=offered)
        self.relay(String, "hardware/emergency_stop", "emergency/stop", target_qos=events)


class SensorConsumers(Relay):
    def __init__(self):
        super().__init__("sensor_consumers")
        self.relay(Image, "camera/image", "consumer/camera", source_qos=latest(1))
        self.relay(LaserScan, "scan", "consumer/lidar", source_qos=latest(2))
        self.relay(Imu, "imu/data", "consumer/imu", source_qos=latest(20))
        self.relay(String, "emergency/stop", "consumer/emergency_stop", source_qos=events)
