# title: A stop publisher that keeps only the last event for who missed it
# fails: stop_repaired
# says: stop_repaired: of 91 were lost

camera_qos = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)
lidar_qos = QoSProfile(depth=1)
imu_qos = QoSProfile(depth=10)


class SensorDrivers(Relay):
    def __init__(self):
        super().__init__("sensor_drivers")
        self.relay(Image, "hardware/camera", "camera/image", target_qos=camera_qos)
        self.relay(LaserScan, "hardware/lidar", "scan", target_qos=lidar_qos)
        self.relay(Imu, "hardware/imu", "imu/data", target_qos=imu_qos)
        self.relay(
            String, "hardware/emergency_stop", "emergency/stop", target_qos=QoSProfile(depth=1)
        )


class SensorConsumers(Relay):
    def __init__(self):
        super().__init__("sensor_consumers")
        self.relay(Image, "camera/image", "consumer/camera", source_qos=camera_qos)
        self.relay(LaserScan, "scan", "consumer/lidar", source_qos=lidar_qos)
        self.relay(Imu, "imu/data", "consumer/imu", source_qos=imu_qos)
        every_event = QoSProfile(history=HistoryPolicy.KEEP_ALL)
        self.relay(String, "emergency/stop", "consumer/emergency_stop", source_qos=every_event)
