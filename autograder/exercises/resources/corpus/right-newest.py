# title: A thread reads the camera all the time and keeps the newest; a timer publishes it
# fails: nothing
import time


class Newest:
    """Keeps the newest picture of a camera."""

    def __init__(self, camera):
        self.camera = camera
        self.picture = None
        self.over = threading.Event()
        self.thread = threading.Thread(target=self.run, daemon=True)
        self.thread.start()

    def run(self):
        while not self.over.wait(0.005):
            try:
                self.picture = self.camera.read()
            except OSError:
                pass

    def end(self):
        self.over.set()
        self.thread.join()


class CameraDriver(Node):
    newest = None
    camera = None

    def __init__(self, device='front'):
        super().__init__('camera_driver')
        try:
            self.camera = Camera(device)
            self.camera.start()
        except OSError:
            if self.camera is not None:
                self.camera.close()
            super().destroy_node()
            raise
        self.newest = Newest(self.camera)
        self.images = self.create_publisher(Image, 'camera/image', 10)
        self.create_timer(0.1, self.publish_newest)
        self.create_subscription(Int32, 'camera/zoom', self.zoom, 10)
        self.create_service(Trigger, 'camera/snapshot', self.snapshot)

    def publish_newest(self):
        if self.newest.picture is not None:
            self.images.publish(self.newest.picture)

    def zoom(self, message):
        try:
            self.camera.zoom(message.data)
        except ValueError:
            pass
        else:
            self.newest.picture = None

    def snapshot(self, request, response):
        self.images.publish(self.camera.read())
        response.success = True
        return response

    def destroy_node(self):
        if self.camera:
            self.camera.close()
        if self.newest:
            self.newest.end()
        super().destroy_node()


# %% resources-lifecycle
class ManagedCamera(LifecycleNode):
    def __init__(self):
        super().__init__('managed_camera')
        self.declare_parameter('device', 'front')
        self.declare_parameter('rate', 10.0)
        self.camera = self.images = self.newest = self.timer = None

    def on_configure(self, state):
        if not 0 < self.get_parameter('rate').value <= 30:
            return TransitionCallbackReturn.FAILURE
        self.period = 1 / self.get_parameter('rate').value
        try:
            self.camera = Camera(self.get_parameter('device').value)
        except OSError:
            return TransitionCallbackReturn.FAILURE
        self.images = self.create_lifecycle_publisher(Image, 'camera/image', 10)
        return TransitionCallbackReturn.SUCCESS

    def on_activate(self, state):
        self.camera.start()
        self.newest = Newest(self.camera)
        self.timer = self.create_timer(self.period, self.publish_newest)
        return super().on_activate(state)

    def publish_newest(self):
        if self.newest.picture is not None:
            self.images.publish(self.newest.picture)

    def halt(self):
        if self.timer:
            self.destroy_timer(self.timer)
            self.timer = None
        if self.newest:
            self.newest.end()
            self.newest = None
        if self.camera:
            self.camera.stop()

    def on_deactivate(self, state):
        self.halt()
        return super().on_deactivate(state)

    def release(self, state=None):
        self.halt()
        if self.camera:
            self.camera.close()
            self.camera = None
        if self.images:
            self.destroy_lifecycle_publisher(self.images)
            self.images = None
        return TransitionCallbackReturn.SUCCESS

    on_cleanup = release
    on_shutdown = release
    on_error = release

    def destroy_node(self):
        self.release()
        super().destroy_node()
