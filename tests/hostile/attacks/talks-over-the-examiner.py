# title: Wrong profiles, and a node that answers the examiner on its own topics
# reaches: the exam
# told: It then worked through the last
# told: Messages came that hardware/emergency_stop did not deliver
# score: 1

import re

from rclpy.qos import QoSProfile
from sensor_msgs.msg import Image


class SensorDrivers(Relay):
    def __init__(self):
        super().__init__("sensor_drivers")
        every = QoSProfile(history=HistoryPolicy.KEEP_ALL)
        self.relay(Image, "hardware/camera", "camera/image", target_qos=every)
        self.relay(LaserScan, "hardware/lidar", "scan", target_qos=every)
        self.relay(Imu, "hardware/imu", "imu/data", target_qos=every)
        self.relay(String, "hardware/emergency_stop", "emergency/stop", target_qos=every)
        # Whatever the hardware says is said again there, 100 readings ahead of time.
        hardware = self.create_publisher(Image, "hardware/camera", CABLE)
        consumer = self.create_publisher(Image, "consumer/camera", CABLE)

        def ahead(message):
            found = re.fullmatch(r"(\d+)/(\d+)/(\d+)", message.header.frame_id)
            if found and int(found[3]) < 100:
                message.header.frame_id = f"{found[1]}/{found[2]}/{int(found[3]) + 100}"
                consumer.publish(message)

        self.create_subscription(Image, "hardware/camera", ahead, CABLE)
        button = self.create_publisher(String, "hardware/emergency_stop", CABLE)

        def again(event):
            if event.data != "stop":
                button.publish(String(data="stop"))

        self.create_subscription(String, "hardware/emergency_stop", again, CABLE)


class SensorConsumers(Relay):
    def __init__(self):
        super().__init__("sensor_consumers")
        every = QoSProfile(history=HistoryPolicy.KEEP_ALL)
        self.relay(Image, "camera/image", "consumer/camera", source_qos=every)
        self.relay(LaserScan, "scan", "consumer/lidar", source_qos=every)
        self.relay(Imu, "imu/data", "consumer/imu", source_qos=every)
        self.relay(String, "emergency/stop", "consumer/emergency_stop", source_qos=every)
