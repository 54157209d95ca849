# title: A driver that publishes every second scan
# fails: lidar_fresh

camera_qos = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)
lidar_qos = QoSProfile(depth=1)
imu_qos = QoSProfile(depth=10)
stop_qos = QoSProfile(history=HistoryPolicy.KEEP_ALL)


class SensorDrivers(Relay):
    def __init__(self):
        super().__init__('sensor_drivers')
        self.relay(Image, 'hardware/camera', 'camera/image', target_qos=camera_qos)
        self.scans = self.create_publisher(LaserScan, 'scan', lidar_qos)
        self.count = 0
        self.create_subscription(LaserScan, 'hardware/lidar', self.every_second, CABLE)
        self.relay(Imu, 'hardware/imu', 'imu/data', target_qos=imu_qos)
        self.relay(String, 'hardware/emergency_stop', 'emergency/stop', target_qos=stop_qos)

    def every_second(self, msg):
        self.count += 1
        if self.count % 2:
            self.scans.publish(msg)


class SensorConsumers(Relay):
    def __init__(self):
        super().__init__('sensor_consumers')
        self.relay(Image, 'camera/image', 'consumer/camera', source_qos=camera_qos)
        self.relay(LaserScan, 'scan', 'consumer/lidar', source_qos=lidar_qos)
        self.relay(Imu, 'imu/data', 'consumer/imu', source_qos=imu_qos)
        self.relay(String, 'emergency/stop', 'consumer/emergency_stop', source_qos=stop_qos)
