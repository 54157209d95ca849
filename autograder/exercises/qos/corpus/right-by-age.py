# title: Deep queues, but consumers that look at the stamp and skip what is old
# fails: nothing

from rclpy.time import Time

deep = QoSProfile(depth=200, reliability=ReliabilityPolicy.BEST_EFFORT)


class SensorDrivers(Relay):
    def __init__(self):
        super().__init__('sensor_drivers')
        self.relay(Image, 'hardware/camera', 'camera/image', target_qos=deep)
        self.relay(LaserScan, 'hardware/lidar', 'scan', target_qos=deep)
        self.relay(Imu, 'hardware/imu', 'imu/data', target_qos=deep)
        self.relay(String, 'hardware/emergency_stop', 'emergency/stop', target_qos=CABLE)


class SensorConsumers(Relay):
    def __init__(self):
        super().__init__('sensor_consumers')
        self.not_older(Image, 'camera/image', 'consumer/camera', 1.0)
        self.not_older(LaserScan, 'scan', 'consumer/lidar', 0.5)
        self.not_older(Imu, 'imu/data', 'consumer/imu', 0.5)
        self.relay(String, 'emergency/stop', 'consumer/emergency_stop', source_qos=CABLE)

    def not_older(self, msg_type, source, target, seconds):
        publisher = self.create_publisher(msg_type, target, CABLE)

        def handle(msg):
            age = self.get_clock().now() - Time.from_msg(msg.header.stamp)
            if age.nanoseconds <= seconds * 1e9:
                publisher.publish(msg)

        self.create_subscription(msg_type, source, handle, deep)
