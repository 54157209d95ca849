# title: Right, and its author left every live view of it in the cell
# fails: nothing

import course
from IPython.display import display

live_qos = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)
last_qos = QoSProfile(depth=1)
burst_qos = QoSProfile(depth=10)
every_qos = QoSProfile(history=HistoryPolicy.KEEP_ALL)


class SensorDrivers(Relay):
    def __init__(self):
        super().__init__("sensor_drivers")
        self.relay(Image, "hardware/camera", "camera/image", target_qos=live_qos)
        self.relay(LaserScan, "hardware/lidar", "scan", target_qos=last_qos)
        self.relay(Imu, "hardware/imu", "imu/data", target_qos=burst_qos)
        self.relay(String, "hardware/emergency_stop", "emergency/stop", target_qos=every_qos)


class SensorConsumers(Relay):
    def __init__(self):
        super().__init__("sensor_consumers")
        self.relay(Image, "camera/image", "consumer/camera", source_qos=live_qos)
        self.relay(LaserScan, "scan", "consumer/lidar", source_qos=last_qos)
        self.relay(Imu, "imu/data", "consumer/imu", source_qos=burst_qos)
        self.relay(String, "emergency/stop", "consumer/emergency_stop", source_qos=every_qos)


session = course.session()
course.run(SensorDrivers)
course.run(SensorConsumers)
display(
    session.graph(),
    session.timeline("scan", "imu/data"),
    session.log_panel(),
    session.parameters("sensor_drivers"),
    session.qos_lab(offered=live_qos, requested=last_qos),
    session.diagnose(),
)
session.graph()
