# title: A node a sensor, composed by a parent that adds its children to the executor it runs in
# fails: nothing

camera_qos = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)
lidar_qos = QoSProfile(depth=1)
imu_qos = QoSProfile(depth=10)
stop_qos = QoSProfile(history=HistoryPolicy.KEEP_ALL)

TABLE = (
    ('camera', Image, 'camera/image', camera_qos),
    ('lidar', LaserScan, 'scan', lidar_qos),
    ('imu', Imu, 'imu/data', imu_qos),
    ('emergency_stop', String, 'emergency/stop', stop_qos),
)


class Part(Relay):
    def __init__(self, name, kind, source, target, **qos):
        super().__init__(name)
        self.relay(kind, source, target, **qos)


class Parent(Node):
    def __init__(self, name, parts):
        super().__init__(name)
        self.parts = parts
        self.once = self.create_timer(0.0, self.adopt)

    def adopt(self):
        self.once.cancel()
        for part in self.parts:
            self.executor.add_node(part)

    def destroy_node(self):
        for part in self.parts:
            part.destroy_node()
        super().destroy_node()


class SensorDrivers(Parent):
    def __init__(self):
        super().__init__('sensor_drivers', [
            Part(f'{n}_driver', k, f'hardware/{n}', t, target_qos=q) for n, k, t, q in TABLE
        ])


class SensorConsumers(Parent):
    def __init__(self):
        super().__init__('sensor_consumers', [
            Part(f'{n}_consumer', k, t, f'consumer/{n}', source_qos=q) for n, k, t, q in TABLE
        ])
