# title: Two plain nodes in the manner of C++, whose intakes hold no more than the 4 that a busy driver finds
# fails: nothing
from rclpy.publisher import Publisher
from rclpy.subscription import Subscription

CAMERA_DEPTH: int = 10
LIDAR_DEPTH: int = 1
IMU_DEPTH: int = 50
INTAKE_DEPTH: int = 4


def make_qos(depth: int, reliability: ReliabilityPolicy) -> QoSProfile:
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=depth,
        reliability=reliability,
        durability=DurabilityPolicy.VOLATILE,
    )


CAMERA_QOS: QoSProfile = make_qos(CAMERA_DEPTH, ReliabilityPolicy.BEST_EFFORT)
LIDAR_QOS: QoSProfile = make_qos(LIDAR_DEPTH, ReliabilityPolicy.RELIABLE)
IMU_QOS: QoSProfile = make_qos(IMU_DEPTH, ReliabilityPolicy.RELIABLE)
STOP_QOS: QoSProfile = QoSProfile(
    history=HistoryPolicy.KEEP_ALL,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.VOLATILE,
)
INTAKE_QOS: QoSProfile = make_qos(INTAKE_DEPTH, ReliabilityPolicy.RELIABLE)


class SensorDrivers(Node):

    camera_pub_: Publisher
    lidar_pub_: Publisher
    imu_pub_: Publisher
    stop_pub_: Publisher
    camera_sub_: Subscription
    lidar_sub_: Subscription
    imu_sub_: Subscription
    stop_sub_: Subscription

    def __init__(self) -> None:
        super().__init__('sensor_drivers')
        # publishers first, so that no callback can meet a missing member
        self.camera_pub_ = self.create_publisher(Image, 'camera/image', CAMERA_QOS)
        self.lidar_pub_ = self.create_publisher(LaserScan, 'scan', LIDAR_QOS)
        self.imu_pub_ = self.create_publisher(Imu, 'imu/data', IMU_QOS)
        self.stop_pub_ = self.create_publisher(String, 'emergency/stop', STOP_QOS)

        self.camera_sub_ = self.create_subscription(
            Image, 'hardware/camera', self.on_camera_, INTAKE_QOS)
        self.lidar_sub_ = self.create_subscription(
            LaserScan, 'hardware/lidar', self.on_lidar_, INTAKE_QOS)
        self.imu_sub_ = self.create_subscription(
            Imu, 'hardware/imu', self.on_imu_, INTAKE_QOS)
        self.stop_sub_ = self.create_subscription(
            String, 'hardware/emergency_stop', self.on_stop_, INTAKE_QOS)

    def on_camera_(self, msg: Image) -> None:
        self.camera_pub_.publish(msg)

    def on_lidar_(self, msg: LaserScan) -> None:
        self.lidar_pub_.publish(msg)

    def on_imu_(self, msg: Imu) -> None:
        self.imu_pub_.publish(msg)

    def on_stop_(self, msg: String) -> None:
        self.stop_pub_.publish(msg)


class SensorConsumers(Node):

    def __init__(self) -> None:
        super().__init__('sensor_consumers')
        self.camera_out_: Publisher = self.create_publisher(Image, 'consumer/camera', CABLE)
        self.lidar_out_: Publisher = self.create_publisher(LaserScan, 'consumer/lidar', CABLE)
        self.imu_out_: Publisher = self.create_publisher(Imu, 'consumer/imu', CABLE)
        self.stop_out_: Publisher = self.create_publisher(
            String, 'consumer/emergency_stop', CABLE)

        self.camera_in_: Subscription = self.create_subscription(
            Image, 'camera/image', self.on_camera_, CAMERA_QOS)
        self.lidar_in_: Subscription = self.create_subscription(
            LaserScan, 'scan', self.on_lidar_, LIDAR_QOS)
        self.imu_in_: Subscription = self.create_subscription(
            Imu, 'imu/data', self.on_imu_, IMU_QOS)
        self.stop_in_: Subscription = self.create_subscription(
            String, 'emergency/stop', self.on_stop_, STOP_QOS)

    def on_camera_(self, msg: Image) -> None:
        self.camera_out_.publish(msg)

    def on_lidar_(self, msg: LaserScan) -> None:
        self.lidar_out_.publish(msg)

    def on_imu_(self, msg: Imu) -> None:
        self.imu_out_.publish(msg)

    def on_stop_(self, msg: String) -> None:
        self.stop_out_.publish(msg)
