# title: A driver that makes a scan of its own and forgets the ranges
# fails: readings_flow
# says: readings_flow: The lidar readings on scan are not what hardware/lidar delivered

camera_qos = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)
lidar_qos = QoSProfile(depth=1)
imu_qos = QoSProfile(depth=10)
stop_qos = QoSProfile(history=HistoryPolicy.KEEP_ALL)

class SensorDrivers(Relay):
    def __init__(self):
        super().__init__('sensor_drivers')
        self.relay(Image, 'hardware/camera', 'camera/image', target_qos=camera_qos)
        self.out = self.create_publisher(LaserScan, 'scan', lidar_qos)
        self.create_subscription(LaserScan, 'hardware/lidar', self.on, CABLE)
        self.relay(Imu, 'hardware/imu', 'imu/data', target_qos=imu_qos)
        self.relay(String, 'hardware/emergency_stop', 'emergency/stop', target_qos=stop_qos)

    def on(self, msg):
        scan = LaserScan()
        scan.header = msg.header
        scan.angle_min, scan.angle_max = msg.angle_min, msg.angle_max
        self.out.publish(scan)


class SensorConsumers(Relay):
    def __init__(self):
        super().__init__('sensor_consumers')
        self.relay(Image, 'camera/image', 'consumer/camera', source_qos=camera_qos)
        self.relay(LaserScan, 'scan', 'consumer/lidar', source_qos=lidar_qos)
        self.relay(Imu, 'imu/data', 'consumer/imu', source_qos=imu_qos)
        self.relay(String, 'emergency/stop', 'consumer/emergency_stop', source_qos=stop_qos)
