# title: A thread with clock.sleep_for, woken by the end of the node's context-free clock event; lifespan and deadline QoS
# fails: nothing
from rclpy.duration import Duration
from rclpy.qos import QoSProfile, HistoryPolicy, ReliabilityPolicy, DurabilityPolicy, LivelinessPolicy

ODD = QoSProfile(depth=3, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL,
                 lifespan=Duration(seconds=2), deadline=Duration(seconds=5),
                 liveliness=LivelinessPolicy.AUTOMATIC, liveliness_lease_duration=Duration(seconds=10))
HEAR = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)


class CameraDriver(Node):
    """Two timers' worth: one sleeper thread in the node's clock, ended through a short sleep."""

    def __init__(self, device='front'):
        super().__init__('sleeper', namespace='/robot/head', start_parameter_services=False, enable_rosout=False)
        self.over, self.camera, self.thread = False, None, None
        try:
            self.camera = Camera(device)
            self.camera.start()
            self.out = self.create_publisher(Image, '/camera/image', ODD)
            self.create_subscription(Int32, '/camera/zoom', self.hear, HEAR)
            self.create_service(Trigger, '/camera/snapshot', self.answer)
            self.extra = self.create_publisher(Int32, '~/zoom_now', 1)
            self.thread = threading.Thread(target=self.run, daemon=True)
            self.thread.start()
        except BaseException:
            self.destroy_node()
            raise

    def run(self):
        # sleeps a tenth of a second of the node's time, and looks each 20 ms of the wall's
        # time whether the driver ends
        begin = self.get_clock().now()
        count = 0
        while not self.over:
            if self.get_clock().now() - begin < Duration(nanoseconds=100_000_000 * (count + 1)):
                threading.Event().wait(0.01)
                continue
            count += 1
            self.take()

    def take(self):
        try:
            self.out.publish(self.camera.read())
            return True
        except OSError:
            return False

    def hear(self, message):
        try:
            self.camera.zoom(message.data)
        except ValueError as e:
            self.get_logger().error(f'no: {e}')
        self.extra.publish(Int32(data=self.camera._zoom))

    def answer(self, request, response):
        response.success = self.take()
        response.message = 'cheese'
        return response

    def destroy_node(self):
        self.over = True
        if self.camera is not None:
            self.camera.close()
        if self.thread is not None:
            self.thread.join(timeout=0.9)
        return super().destroy_node()


# %% resources-lifecycle
from rcl_interfaces.msg import ParameterDescriptor, FloatingPointRange


class ManagedCamera(LifecycleNode):
    """Bounds in the parameter's descriptor; sleeps in a thread with the node's clock."""

    def __init__(self):
        super().__init__('managed_sleeper')
        self.declare_parameter('device', 'front')
        self.declare_parameter('rate', 10.0, ParameterDescriptor(
            floating_point_range=[FloatingPointRange(from_value=1e-6, to_value=30.0)]))
        self.camera = self.images = self.thread = None

    def on_configure(self, state):
        self.period = Duration(seconds=1 / self.get_parameter('rate').value)
        try:
            self.camera = Camera(self.get_parameter('device').value)
        except OSError as e:
            self.get_logger().error(str(e))
            return TransitionCallbackReturn.FAILURE
        self.images = self.create_lifecycle_publisher(Image, 'camera/image', ODD)
        return super().on_configure(state)

    def on_activate(self, state):
        self.camera.start()
        result = super().on_activate(state)
        self.over = threading.Event()
        self.thread = threading.Thread(target=self.run, args=(self.over,), daemon=True)
        self.thread.start()
        return result

    def run(self, over):
        while not over.is_set():
            due = self.get_clock().now() + self.period
            while self.get_clock().now() < due:
                if over.wait(0.002):
                    return
            try:
                self.images.publish(self.camera.read())
            except OSError:
                return

    def on_deactivate(self, state):
        self.rest()
        return super().on_deactivate(state)

    def rest(self):
        if self.thread:
            self.over.set()
            self.thread.join()
            self.thread = None
        if self.camera:
            self.camera.stop()

    def give(self, state=None):
        self.rest()
        if self.camera:
            self.camera.close()
            self.camera = None
        if self.images:
            self.destroy_lifecycle_publisher(self.images)
            self.images = None
        return TransitionCallbackReturn.SUCCESS

    on_cleanup = on_shutdown = on_error = give

    def destroy_node(self):
        self.give()
        super().destroy_node()
