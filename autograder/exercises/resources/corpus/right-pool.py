# title: A thread pool, reentrant callbacks, and parameters that are refused when they are set
# fails: nothing

from concurrent.futures import ThreadPoolExecutor

from rcl_interfaces.msg import SetParametersResult
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.qos import QoSProfile, ReliabilityPolicy

LIVE = QoSProfile(depth=20, reliability=ReliabilityPolicy.BEST_EFFORT)


class CameraDriver(Node):
    def __init__(self, device='front'):
        super().__init__('camera_driver')
        self.pool = self.camera = None
        try:
            self.pool = ThreadPoolExecutor(max_workers=1)
            self.camera = Camera(device)
            self.camera.start()
            group = ReentrantCallbackGroup()
            self.image_pub = self.create_publisher(Image, 'camera/image', LIVE)
            self.create_timer(0.1, lambda: self.pool.submit(self.shoot), callback_group=group)
            self.create_subscription(
                Int32, 'camera/zoom', self.on_zoom, 10, callback_group=group
            )
            self.create_service(
                Trigger, 'camera/snapshot', self.on_snapshot, callback_group=group
            )
        except:
            self.destroy_node()
            raise

    def shoot(self):
        self.image_pub.publish(self.camera.read())

    def on_zoom(self, msg):
        self.camera.zoom(msg.data)

    async def on_snapshot(self, request, response):
        try:
            self.shoot()
            response.success = True
        except OSError as e:
            response.message = str(e)
        return response

    def destroy_node(self):
        camera, self.camera = self.camera, None
        pool, self.pool = self.pool, None
        if camera:
            camera.close()
        if pool:
            pool.shutdown(wait=True, cancel_futures=True)
        return super().destroy_node()


# %% resources-lifecycle
class ManagedCamera(LifecycleNode):
    def __init__(self, **kwargs):
        super().__init__('managed_camera', **kwargs)
        self.declare_parameter('device', 'front')
        self.declare_parameter('rate', 10.0)
        self.add_on_set_parameters_callback(self.vet)
        self.camera = None
        self.image_pub = None
        self.frame_timer = None

    def vet(self, parameters):
        for parameter in parameters:
            if parameter.name == 'rate' and not 0 < parameter.value <= 30:
                return SetParametersResult(successful=False, reason='0 < rate <= 30')
        return SetParametersResult(successful=True)

    def on_configure(self, state):
        try:
            self.camera = Camera(self.get_parameter('device').value)
            self.image_pub = self.create_lifecycle_publisher(Image, 'camera/image', LIVE)
            self.frame_timer = self.create_timer(
                1 / self.get_parameter('rate').value, self.frame, autostart=False
            )
        except OSError as e:
            self.get_logger().error(f'{e}')
            return TransitionCallbackReturn.FAILURE
        return TransitionCallbackReturn.SUCCESS

    def on_activate(self, state):
        try:
            self.camera.start()
        except OSError as e:
            self.get_logger().error(f'{e}')
            return TransitionCallbackReturn.ERROR
        self.frame_timer.reset()
        return super().on_activate(state)

    def on_deactivate(self, state):
        self.frame_timer.cancel()
        self.camera.stop()
        return super().on_deactivate(state)

    def frame(self):
        self.image_pub.publish(self.camera.read())

    def free(self):
        if self.frame_timer is not None:
            self.destroy_timer(self.frame_timer)
        if self.image_pub is not None:
            self.destroy_lifecycle_publisher(self.image_pub)
        if self.camera is not None:
            self.camera.close()
        self.camera = self.image_pub = self.frame_timer = None

    def on_cleanup(self, state):
        self.free()
        return TransitionCallbackReturn.SUCCESS

    def on_shutdown(self, state):
        self.free()
        return TransitionCallbackReturn.SUCCESS

    def on_error(self, state):
        self.free()
        return TransitionCallbackReturn.SUCCESS

    def destroy_node(self):
        self.free()
        return super().destroy_node()
