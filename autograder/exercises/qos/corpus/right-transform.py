# title: Consumers that hand on what they really act on: cleaned, in the frame of the robot
# fails: nothing

import math

camera_qos = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)
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
        self.scan = self.create_publisher(LaserScan, 'consumer/lidar', 10)
        self.create_subscription(LaserScan, 'scan', self.clean, lidar_qos)
        self.relay(Imu, 'imu/data', 'consumer/imu', source_qos=imu_qos)
        self.relay(String, 'emergency/stop', 'consumer/emergency_stop', source_qos=stop_qos)

    def clean(self, scan):
        scan.header.frame_id = 'base_link'
        scan.ranges = [
            r if scan.range_min <= r <= scan.range_max else math.inf for r in scan.ranges
        ]
        self.scan.publish(scan)
