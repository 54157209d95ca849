# title: An IMU driver that keeps the past for whoever asks, though its own consumer does not
# fails: late_joiner
# says: late_joiner: It was handed imu readings from before it started

camera_qos = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)
lidar_qos = QoSProfile(depth=1)
imu_qos = QoSProfile(depth=10)
stop_qos = QoSProfile(history=HistoryPolicy.KEEP_ALL)

class SensorDrivers(Relay):
    def __init__(self):
        super().__init__('sensor_drivers')
        self.relay(Image, 'hardware/camera', 'camera/image', target_qos=camera_qos)
        self.relay(LaserScan, 'hardware/lidar', 'scan', target_qos=lidar_qos)
        past = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.relay(Imu, "hardware/imu", "imu/data", target_qos=past)
        self.relay(String, 'hardware/emergency_stop', 'emergency/stop', target_qos=stop_qos)


class SensorConsumers(Relay):
    def __init__(self):
        super().__init__('sensor_consumers')
        self.relay(Image, 'camera/image', 'consumer/camera', source_qos=camera_qos)
        self.relay(LaserScan, 'scan', 'consumer/lidar', source_qos=lidar_qos)
        self.relay(Imu, 'imu/data', 'consumer/imu', source_qos=imu_qos)
        self.relay(String, 'emergency/stop', 'consumer/emergency_stop', source_qos=stop_qos)
