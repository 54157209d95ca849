# title: Messages of a megabyte as fast as they go, on every topic that the examiner reads
# score: any

import threading

from rclpy.qos import QoSProfile


class Flood(Relay):
    def __init__(self, name):
        super().__init__(name)
        frame = Image(data=bytes(1_000_000))
        publishers = [
            self.create_publisher(Image, topic, QoSProfile(depth=1))
            for topic in ("camera/image", "consumer/camera", "hardware/camera")
        ]

        def flood():
            while True:
                for publisher in publishers:
                    publisher.publish(frame)

        threading.Thread(target=flood, daemon=True).start()


class SensorDrivers(Flood):
    def __init__(self):
        super().__init__("sensor_drivers")


class SensorConsumers(Flood):
    def __init__(self):
        super().__init__("sensor_consumers")
