# title: A camera link that re-sends, beside a best-effort decoy
# fails: camera_best_effort

camera_qos = QoSProfile(depth=5)
lidar_qos = QoSProfile(depth=1)
imu_qos = QoSProfile(depth=10)
stop_qos = QoSProfile(history=HistoryPolicy.KEEP_ALL)


class SensorDrivers(Relay):
    def __init__(self):
        super().__init__('sensor_drivers')
        self.relay(Image, 'hardware/camera', 'camera/image', target_qos=camera_qos)
        self.relay(LaserScan, 'hardware/lidar', 'scan', target_qos=lidar_qos)
        self.relay(Imu, 'hardware/imu', 'imu/data', target_qos=imu_qos)
        self.relay(String, 'hardware/emergency_stop', 'emergency/stop', target_qos=stop_qos)


class SensorConsumers(Relay):
    def __init__(self):
        super().__init__('sensor_consumers')
        self.relay(Image, 'camera/image', 'consumer/camera', source_qos=camera_qos)
        self.create_subscription(Image, 'camera/image', print, qos_profile_sensor_data)
        self.relay(LaserScan, 'scan', 'consumer/lidar', source_qos=lidar_qos)
        self.relay(Imu, 'imu/data', 'consumer/imu', source_qos=imu_qos)
        self.relay(String, 'emergency/stop', 'consumer/emergency_stop', source_qos=stop_qos)
