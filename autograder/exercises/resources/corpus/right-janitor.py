# title: Two publishers on camera/image, lifespan 0.3 s; cleanup registered in weakref.finalize; ticks async; managed: async timer, exclusive groups, a monitor subscription
# fails: nothing
import weakref
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.duration import Duration
from rclpy.qos import QoSProfile, ReliabilityPolicy

SHORT = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT, lifespan=Duration(seconds=0.3))


class CameraDriver(Node):
    def __init__(self, device='front'):
        super().__init__('twin', cli_args=['--ros-args', '-r', '__ns:=/left'])
        try:
            camera = self.camera = Camera(device)
            self.free = weakref.finalize(self, camera.close)
            camera.start()
            self.live = self.create_publisher(Image, '/camera/image', SHORT)
            self.single = self.create_publisher(Image, '/camera/image', 1)
            self.create_timer(0.1, self.tick, callback_group=MutuallyExclusiveCallbackGroup())
            self.create_subscription(Int32, '/camera/zoom', self.zoom, 1, raw=True)
            self.create_service(Trigger, '/camera/snapshot', self.snap)
        except BaseException:
            self.destroy_node()
            raise

    async def tick(self):
        try:
            self.live.publish(self.camera.read())
        except OSError:
            self.get_logger().debug('no picture')

    def zoom(self, raw):
        from rclpy.serialization import deserialize_message
        try:
            self.camera.zoom(deserialize_message(raw, Int32).data)
        except ValueError as e:
            self.get_logger().error(str(e))

    async def snap(self, request, response):
        try:
            self.single.publish(self.camera.read())
            response.success = True
        except OSError as e:
            response.message = str(e)
        return response

    def destroy_node(self):
        if hasattr(self, 'free'):
            self.free()
        super().destroy_node()


# %% resources-lifecycle
class ManagedCamera(LifecycleNode):
    def __init__(self):
        super().__init__('managed_twin')
        self.declare_parameter('device', 'front')
        self.declare_parameter('rate', 10.0)
        self.create_subscription(Image, 'camera/image', lambda _: None, 1)
        self.camera = self.images = self.timer = None

    def on_configure(self, state):
        self.period = self.get_parameter('rate').value
        if not 0 < self.period <= 30:
            return TransitionCallbackReturn.ERROR
        try:
            self.camera = Camera(self.get_parameter('device').value)
        except OSError:
            return TransitionCallbackReturn.ERROR
        self.images = self.create_publisher(Image, 'camera/image', SHORT)
        return TransitionCallbackReturn.SUCCESS

    def on_activate(self, state):
        self.camera.start()
        self.timer = self.create_timer(1 / self.period, self.tick, callback_group=MutuallyExclusiveCallbackGroup())
        return TransitionCallbackReturn.SUCCESS

    async def tick(self):
        self.images.publish(self.camera.read())

    def on_deactivate(self, state):
        self.timer.cancel()
        self.timer.destroy()
        self.destroy_timer(self.timer)
        self.timer = None
        self.camera.stop()
        return TransitionCallbackReturn.SUCCESS

    def on_cleanup(self, state):
        if self.timer:
            self.destroy_timer(self.timer)
        if self.camera:
            self.camera.close()
        if self.images:
            self.destroy_publisher(self.images)
        self.camera = self.images = self.timer = None
        return TransitionCallbackReturn.SUCCESS

    on_shutdown = on_error = on_cleanup

    def destroy_node(self):
        self.on_cleanup(None)
        super().destroy_node()
