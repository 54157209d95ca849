# title: A driver that publishes the previous scan when the next one comes in
# fails: readings_flow
# says: readings_flow: One more lidar reading came in

camera_qos = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)
lidar_qos = QoSProfile(depth=1)
imu_qos = QoSProfile(depth=10)
stop_qos = QoSProfile(history=HistoryPolicy.KEEP_ALL)

class SensorDrivers(Relay):
    def __init__(self):
        super().__init__('sensor_drivers')
        self.relay(Image, 'hardware/camera', 'camera/image', target_qos=camera_qos)
        self.last = None
        self.out = self.create_publisher(LaserScan, 'scan', lidar_qos)
        self.create_subscription(LaserScan, 'hardware/lidar', self.on, CABLE)
        self.relay(Imu, 'hardware/imu', 'imu/data', target_qos=imu_qos)
        self.relay(String, 'hardware/emergency_stop', 'emergency/stop', target_qos=stop_qos)

    def on(self, msg):
        if self.last is not None:
            self.out.publish(self.last)
        self.last = msg


class SensorConsumers(Relay):
    def __init__(self):
        super().__init__('sensor_consumers')
        self.relay(Image, 'camera/image', 'consumer/camera', source_qos=camera_qos)
        self.relay(LaserScan, 'scan', 'consumer/lidar', source_qos=lidar_qos)
        self.relay(Imu, 'imu/data', 'consumer/imu', source_qos=imu_qos)
        self.relay(String, 'emergency/stop', 'consumer/emergency_stop', source_qos=stop_qos)
