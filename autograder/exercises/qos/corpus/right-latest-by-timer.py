# title: Consumers that keep the latest reading and act on it in a timer
# fails: nothing

camera_qos = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
lidar_qos = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
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
        self.latest = {}
        self.outputs = {}
        for name, msg_type, topic, qos in (
            ('camera', Image, 'camera/image', camera_qos),
            ('lidar', LaserScan, 'scan', lidar_qos),
        ):
            self.outputs[name] = self.create_publisher(msg_type, f'consumer/{name}', 10)
            self.create_subscription(
                msg_type, topic, lambda msg, n=name: self.latest.update({n: msg}), qos
            )
        self.create_timer(0.05, self.act)
        self.relay(Imu, 'imu/data', 'consumer/imu', source_qos=imu_qos)
        self.relay(String, 'emergency/stop', 'consumer/emergency_stop', source_qos=stop_qos)

    def act(self):
        for name, msg in self.latest.items():
            self.outputs[name].publish(msg)
