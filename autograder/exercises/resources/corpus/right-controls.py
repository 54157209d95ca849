# title: Zoom and snapshot in a node of their own, which an executor and a thread of the driver spin
# fails: nothing
from rclpy.executors import SingleThreadedExecutor


class Controls(Node):
    def __init__(self, driver):
        super().__init__('camera_controls')
        self.driver = driver
        self.create_subscription(Int32, 'camera/zoom', self.on_zoom, 10)
        self.create_service(Trigger, 'camera/snapshot', self.on_snapshot)

    def on_zoom(self, msg):
        try:
            self.driver.camera.zoom(msg.data)
        except ValueError as error:
            self.get_logger().warning(str(error))

    def on_snapshot(self, request, response):
        response.success = self.driver.shoot()
        return response


class CameraDriver(Node):
    def __init__(self, device='front'):
        self.camera = Camera(device)
        try:
            self.camera.start()
            super().__init__('camera_driver')
        except BaseException:
            self.camera.close()
            raise
        self.gone = False
        self.one_at_a_time = threading.Lock()
        self.publisher = self.create_publisher(Image, 'camera/image', 10)
        self.controls = Controls(self)
        self.executor_of_controls = SingleThreadedExecutor(context=self.context)
        self.executor_of_controls.add_node(self.controls)
        self.thread = threading.Thread(target=self.spin_controls)
        self.thread.start()
        self.create_timer(0.1, self.shoot)

    def spin_controls(self):
        while not self.gone:
            self.executor_of_controls.spin_once(timeout_sec=0.1)

    def shoot(self):
        try:
            with self.one_at_a_time:
                self.publisher.publish(self.camera.read())
        except OSError:
            return False
        return True

    def destroy_node(self):
        if self.gone:
            return
        self.gone = True
        self.camera.close()
        self.thread.join()
        self.executor_of_controls.shutdown()
        self.controls.destroy_node()
        super().destroy_node()


# %% resources-lifecycle
class ManagedCamera(LifecycleNode):
    """One way out of every state, under a lock."""

    def __init__(self):
        super().__init__('managed_camera')
        self.declare_parameter('device', 'front')
        self.declare_parameter('rate', 10.0)
        self.lock = threading.RLock()
        self.camera = self.publisher = self.timer = None
        self.gone = False

    def on_configure(self, state):
        self.rate = self.get_parameter('rate').value
        if not 0.0 < self.rate <= 30.0:
            return TransitionCallbackReturn.FAILURE
        try:
            self.camera = Camera(self.get_parameter('device').value)
        except OSError as error:
            self.get_logger().error(f'no camera: {error}')
            return TransitionCallbackReturn.FAILURE
        self.publisher = self.create_publisher(Image, 'camera/image', 1)
        return TransitionCallbackReturn.SUCCESS

    def on_activate(self, state):
        try:
            self.camera.start()
        except OSError:
            return TransitionCallbackReturn.ERROR
        self.timer = self.create_timer(1 / self.rate, self.on_timer)
        return TransitionCallbackReturn.SUCCESS

    def on_deactivate(self, state):
        self.stop_stream()
        return TransitionCallbackReturn.SUCCESS

    def on_timer(self):
        with self.lock:
            if self.timer is not None:
                try:
                    self.publisher.publish(self.camera.read())
                except OSError as error:
                    self.get_logger().warning(f'a picture less: {error}')

    def stop_stream(self):
        with self.lock:
            if self.timer is not None:
                self.destroy_timer(self.timer)
                self.timer = None
            if self.camera is not None:
                self.camera.stop()

    def give_back(self, state=None):
        if self.camera is not None:
            self.camera.close()  # whoever waits for a picture lets go of the lock
        self.stop_stream()
        with self.lock:
            self.camera = None
            if self.publisher is not None:
                self.destroy_publisher(self.publisher)
                self.publisher = None
        return TransitionCallbackReturn.SUCCESS

    on_cleanup = on_shutdown = on_error = give_back

    def destroy_node(self):
        if not self.gone:
            self.gone = True
            self.give_back()
            super().destroy_node()
