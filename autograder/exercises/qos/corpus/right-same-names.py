# title: Both nodes bear the same name and come out of one function
# fails: nothing

camera_qos = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)
lidar_qos = QoSProfile(depth=1)
imu_qos = QoSProfile(depth=10)
stop_qos = QoSProfile(history=HistoryPolicy.KEEP_ALL)

SENSORS = (
    (Image, 'camera', 'camera/image', camera_qos),
    (LaserScan, 'lidar', 'scan', lidar_qos),
    (Imu, 'imu', 'imu/data', imu_qos),
    (String, 'emergency_stop', 'emergency/stop', stop_qos),
)


def make_node_class(drives):
    class Generated(Relay):
        def __init__(self):
            super().__init__('robot')
            for msg_type, name, topic, qos in SENSORS:
                if drives:
                    self.relay(msg_type, f'hardware/{name}', topic, target_qos=qos)
                else:
                    self.relay(msg_type, topic, f'consumer/{name}', source_qos=qos)

    return Generated


SensorDrivers = make_node_class(True)
SensorConsumers = make_node_class(False)
