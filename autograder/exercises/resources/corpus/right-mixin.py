# title: One mix-in that opens and closes the camera for both nodes; its stream is tried early
# fails: nothing


class HasCamera:
    """Cleanup in close_camera(), and destroy_node() that calls it, for any node."""

    camera = None

    def open_camera(self, device):
        self.close_camera()
        self.camera = Camera(device)

    def close_camera(self):
        if self.camera is not None:
            self.camera.close()
            self.camera = None

    def destroy_node(self):
        try:
            self.close_camera()
        finally:
            super().destroy_node()


class CameraDriver(HasCamera, Node):
    def __init__(self, device='front'):
        super().__init__('camera_driver')
        self.lock = threading.Lock()
        try:
            self.open_camera(device)
            self.camera.start()
        except OSError:
            self.destroy_node()
            raise
        self.pub = self.create_publisher(Image, 'camera/image', 10)
        self.timer = self.create_timer(0.1, self.publish)
        self.sub = self.create_subscription(Int32, 'camera/zoom', self.zoom, 10)
        self.srv = self.create_service(Trigger, 'camera/snapshot', self.snapshot)

    def publish(self):
        with self.lock:
            camera = self.camera
            if camera is None:
                return False
            try:
                self.pub.publish(camera.read())
            except OSError:
                return False
            return True

    def zoom(self, message):
        with self.lock:
            self.camera.zoom(message.data)

    def snapshot(self, request, response):
        response.success = self.publish()
        return response


# %% resources-lifecycle
class ManagedCamera(HasCamera, LifecycleNode):
    def __init__(self):
        super().__init__('managed_camera')
        self.device = self.declare_parameter('device', 'front')
        self.rate = self.declare_parameter('rate', 10.0)
        self.pub = None
        self.timer = None

    def on_configure(self, state):
        rate = self.get_parameter('rate').value
        if not (0.0 < rate <= 30.0):
            return TransitionCallbackReturn.FAILURE
        try:
            self.open_camera(self.get_parameter('device').value)
            self.camera.start()  # does it stream?
            self.camera.stop()
        except OSError:
            self.close_camera()
            return TransitionCallbackReturn.FAILURE
        self.pub = self.create_lifecycle_publisher(Image, 'camera/image', 10)
        self.timer = self.create_timer(1.0 / rate, self.publish)
        self.timer.cancel()
        return super().on_configure(state)

    def on_activate(self, state):
        result = super().on_activate(state)
        self.camera.start()
        self.timer.reset()
        return result

    def on_deactivate(self, state):
        self.timer.cancel()
        self.camera.stop()
        return super().on_deactivate(state)

    def publish(self):
        if self.pub is not None and self.pub.is_activated:
            self.pub.publish(self.camera.read())

    def release(self):
        if self.timer is not None:
            self.destroy_timer(self.timer)
            self.timer = None
        if self.pub is not None:
            self.destroy_lifecycle_publisher(self.pub)
            self.pub = None
        self.close_camera()
        return TransitionCallbackReturn.SUCCESS

    def on_cleanup(self, state):
        return self.release()

    def on_shutdown(self, state):
        return self.release()

    def on_error(self, state):
        return self.release()
