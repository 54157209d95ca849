# title: rclpy's own Rate in a thread, for both nodes
# fails: nothing
from rclpy.exceptions import ROSInterruptException


class CameraDriver(Node):
    camera = None
    thread = None
    rate = None
    done = False

    def __init__(self, device='front'):
        super().__init__('camera_driver')
        try:
            self.lock = threading.Lock()
            self.camera = Camera(device)
            self.camera.start()
            self.image_pub = self.create_publisher(Image, 'camera/image', 10)
            self.zoom_sub = self.create_subscription(Int32, 'camera/zoom', self.zoom_cb, 10)
            self.snap_srv = self.create_service(Trigger, 'camera/snapshot', self.snap_cb)
            self.rate = self.create_rate(10)
            self.thread = threading.Thread(target=self.loop)
            self.thread.start()
        except Exception:
            self.destroy_node()
            raise

    def loop(self):
        while not self.done:
            try:
                self.rate.sleep()
                if not self.done:
                    self.grab()
            except (RuntimeError, ROSInterruptException, OSError):
                return

    def grab(self):
        with self.lock:
            self.image_pub.publish(self.camera.read())

    def zoom_cb(self, msg):
        try:
            self.camera.zoom(msg.data)
        except ValueError as e:
            self.get_logger().warn(f'{e}')

    def snap_cb(self, req, res):
        try:
            self.grab()
            res.success = True
        except OSError as e:
            res.success = False
            res.message = str(e)
        return res

    def destroy_node(self):
        self.done = True
        if self.camera is not None:
            self.camera.close()
        if self.rate is not None:
            self.destroy_rate(self.rate)
            self.rate.destroy()
        if self.thread is not None:
            self.thread.join()
            self.thread = None
        super().destroy_node()


# %% resources-lifecycle
class ManagedCamera(LifecycleNode):
    def __init__(self):
        super().__init__('managed_camera')
        self.declare_parameter('device', 'front')
        self.declare_parameter('rate', 10.0)
        self.cam = self.pub = self.rate = self.thread = None

    def on_configure(self, state):
        hz = self.get_parameter('rate').value
        if not (0 < hz <= 30):
            return TransitionCallbackReturn.FAILURE
        try:
            self.cam = Camera(self.get_parameter('device').value)
        except OSError:
            return TransitionCallbackReturn.FAILURE
        self.hz = hz
        self.pub = self.create_lifecycle_publisher(Image, 'camera/image', 10)
        return TransitionCallbackReturn.SUCCESS

    def on_activate(self, state):
        self.cam.start()
        self.running = True
        self.rate = self.create_rate(self.hz)
        self.thread = threading.Thread(target=self.loop, args=(self.rate,))
        self.thread.start()
        return super().on_activate(state)

    def loop(self, rate):
        while self.running:
            rate.sleep()
            if self.running:
                self.pub.publish(self.cam.read())

    def on_deactivate(self, state):
        self.quiet()
        return super().on_deactivate(state)

    def quiet(self):
        if self.thread is not None:
            self.running = False
            self.destroy_rate(self.rate)
            self.rate.destroy()
            self.thread.join()
            self.thread = self.rate = None
        if self.cam is not None:
            self.cam.stop()

    def all_back(self):
        self.quiet()
        if self.cam is not None:
            self.cam.close()
            self.cam = None
        if self.pub is not None:
            self.destroy_lifecycle_publisher(self.pub)
            self.pub = None

    def on_cleanup(self, state):
        self.all_back()
        return TransitionCallbackReturn.SUCCESS

    def on_shutdown(self, state):
        self.all_back()
        return TransitionCallbackReturn.SUCCESS

    def on_error(self, state):
        self.all_back()
        return TransitionCallbackReturn.SUCCESS

    def destroy_node(self):
        self.all_back()
        super().destroy_node()
