# title: An estimator that takes the IMU five by five, a control loop at 5 Hz that acts on the newest
# fails: nothing

import time

from rclpy.time import Time


class SensorDrivers(Relay):
    def __init__(self):
        super().__init__('sensor_drivers')
        self.relay(Image, 'hardware/camera', 'camera/image', target_qos=qos_profile_sensor_data)
        self.relay(LaserScan, 'hardware/lidar', 'scan', target_qos=qos_profile_sensor_data)
        self.relay(Imu, 'hardware/imu', 'imu/data', target_qos=QoSProfile(depth=50))
        self.relay(String, 'hardware/emergency_stop', 'emergency/stop')


class SensorConsumers(Relay):
    def __init__(self):
        super().__init__('sensor_consumers')
        self.picture = self.create_publisher(Image, 'consumer/camera', 1)
        self.scan = self.create_publisher(LaserScan, 'consumer/lidar', 1)
        self.states = self.create_publisher(Imu, 'consumer/imu', 50)
        self.batch, self.latest = [], None
        self.create_subscription(Image, 'camera/image', self.see, qos_profile_sensor_data)
        newest = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
        self.create_subscription(LaserScan, 'scan', self.note, newest)
        self.create_subscription(Imu, 'imu/data', self.integrate, QoSProfile(depth=50))
        self.relay(String, 'emergency/stop', 'consumer/emergency_stop')
        self.create_timer(0.2, self.avoid)

    def see(self, msg):
        time.sleep(0.02)
        self.picture.publish(msg)

    def note(self, msg):
        self.latest = msg

    def avoid(self):
        scan, self.latest = self.latest, None
        if scan is None:
            return
        if (self.get_clock().now() - Time.from_msg(scan.header.stamp)).nanoseconds < 0.5e9:
            self.scan.publish(scan)

    def integrate(self, msg):
        self.batch.append(msg)
        if len(self.batch) == 5:
            for reading in self.batch:
                self.states.publish(reading)
            self.batch.clear()
