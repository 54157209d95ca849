# title: Plain nodes, own callbacks, other node names, absolute topics
# fails: nothing

from rclpy.callback_groups import ReentrantCallbackGroup

PLAN = {
    "camera": (Image, "/camera/image", qos_profile_sensor_data),
    "lidar": (LaserScan, "/scan", QoSProfile(depth=1)),
    "imu": (Imu, "/imu/data", QoSProfile(depth=15)),
    "emergency_stop": (
        String,
        "/emergency/stop",
        QoSProfile(
            history=HistoryPolicy.KEEP_ALL,
            reliability=ReliabilityPolicy.RELIABLE,
            durability=DurabilityPolicy.TRANSIENT_LOCAL,
        ),
    ),
}


class SensorDrivers(Node):
    def __init__(self):
        super().__init__("hardware_bridge", namespace="/")
        self.outputs = {}
        for name, (msg_type, topic, qos) in PLAN.items():
            self.outputs[name] = self.create_publisher(msg_type, topic, qos)
            self.create_subscription(
                msg_type, f"/hardware/{name}", lambda msg, n=name: self.forward(n, msg), CABLE
            )

    def forward(self, name, msg):
        self.get_logger().debug(f"{name} reading")
        self.outputs[name].publish(msg)


class SensorConsumers(Node):
    def __init__(self):
        super().__init__("brain")
        group = ReentrantCallbackGroup()
        self.seen = dict.fromkeys(PLAN, 0)
        for name, (msg_type, topic, qos) in PLAN.items():
            output = self.create_publisher(msg_type, f"/consumer/{name}", CABLE)
            self.create_subscription(
                msg_type, topic, self.handler(name, output), qos, callback_group=group
            )

    def handler(self, name, output):
        async def handle(msg):
            self.seen[name] += 1
            output.publish(msg)

        return handle
