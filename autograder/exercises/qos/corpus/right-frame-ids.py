# title: Drivers with short queues for the hardware, that set the frame id; a logger listens along
# fails: nothing

camera_qos = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)
lidar_qos = QoSProfile(depth=1)
imu_qos = QoSProfile(depth=10)
stop_qos = QoSProfile(history=HistoryPolicy.KEEP_ALL)


class SensorDrivers(Node):
    def __init__(self):
        super().__init__('drivers')
        for msg_type, name, topic, qos in (
            (Image, 'camera', 'camera/image', camera_qos),
            (LaserScan, 'lidar', 'scan', lidar_qos),
            (Imu, 'imu', 'imu/data', imu_qos),
        ):
            self.drive(msg_type, name, topic, qos)
        stops = self.create_publisher(String, 'emergency/stop', stop_qos)
        self.create_subscription(String, 'hardware/emergency_stop', stops.publish, 10)

    def drive(self, msg_type, name, topic, qos):
        publisher = self.create_publisher(msg_type, topic, qos)

        def handle(msg):
            msg.header.frame_id = f'{name}_link'
            msg.header.stamp = self.get_clock().now().to_msg()
            publisher.publish(msg)

        self.create_subscription(msg_type, f'hardware/{name}', handle, 10)


class SensorConsumers(Relay):
    def __init__(self):
        super().__init__('sensor_consumers')
        self.relay(Image, 'camera/image', 'consumer/camera', source_qos=camera_qos)
        self.relay(LaserScan, 'scan', 'consumer/lidar', source_qos=lidar_qos)
        self.relay(Imu, 'imu/data', 'consumer/imu', source_qos=imu_qos)
        self.relay(String, 'emergency/stop', 'consumer/emergency_stop', source_qos=stop_qos)
        self.create_subscription(String, 'emergency/stop', self.log, qos_profile_sensor_data)

    def log(self, msg):
        self.get_logger().info(msg.data)
