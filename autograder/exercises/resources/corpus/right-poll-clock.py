# title: Threads that look at the node's clock every 5 ms, in float seconds
# fails: nothing
import time


class Poller:
    """Calls `act` each `period` s by the clock of a node."""

    def __init__(self, node, period, act):
        self.clock, self.period, self.act = node.get_clock(), period, act
        self.over = threading.Event()
        self.thread = threading.Thread(target=self.run, daemon=True)
        self.thread.start()

    def seconds(self):
        return self.clock.now().nanoseconds / 1e9

    def run(self):
        last = self.seconds()
        while not self.over.wait(0.005):
            if self.seconds() - last >= self.period:
                last = self.seconds()
                try:
                    self.act()
                except OSError:
                    pass

    def end(self):
        self.over.set()
        self.thread.join()


class CameraDriver(Node):
    def __init__(self, device='front'):
        super().__init__('polling_camera')
        self.poller = self.camera = None
        self.device = device
        try:
            self.camera = Camera(device)
            self.camera.start()
            self.images = self.create_publisher(Image, 'camera/image', 10)
            self.create_subscription(Int32, 'camera/zoom', lambda m: self.camera.zoom(m.data), 10)
            self.create_service(Trigger, 'camera/snapshot', self.snap)
            self.poller = Poller(self, 0.1, self.shoot)
        except BaseException:
            self.destroy_node()
            raise

    def shoot(self):
        self.images.publish(self.camera.read())

    def snap(self, request, response):
        try:
            self.shoot()
            response.success = True
        except OSError as e:
            response.message = str(e)
        return response

    def destroy_node(self):
        if self.camera:
            self.camera.close()
        if self.poller:
            self.poller.end()
            self.poller = None
        super().destroy_node()


# %% resources-lifecycle
class ManagedCamera(LifecycleNode):
    def __init__(self):
        super().__init__('polling_manager')
        self.declare_parameters('', [('device', 'front'), ('rate', 10.0)])
        self.camera = self.images = self.poller = None

    def on_configure(self, state):
        self.rate = self.get_parameter('rate').value
        if not 0 < self.rate <= 30:
            return TransitionCallbackReturn.FAILURE
        try:
            self.camera = Camera(self.get_parameter('device').value)
        except OSError:
            return TransitionCallbackReturn.FAILURE
        self.images = self.create_lifecycle_publisher(Image, 'camera/image', 10)
        return super().on_configure(state)

    def on_activate(self, state):
        self.camera.start()
        result = super().on_activate(state)
        self.poller = Poller(self, 1 / self.rate, lambda: self.images.publish(self.camera.read()))
        return result

    def on_deactivate(self, state):
        self.rest()
        return super().on_deactivate(state)

    def rest(self):
        if self.poller:
            self.poller.end()
            self.poller = None
        if self.camera:
            self.camera.stop()

    def on_cleanup(self, state):
        self.rest()
        if self.camera:
            self.camera.close()
            self.camera = None
        if self.images:
            self.destroy_lifecycle_publisher(self.images)
            self.images = None
        return TransitionCallbackReturn.SUCCESS

    on_shutdown = on_error = on_cleanup

    def destroy_node(self):
        self.on_cleanup(None)
        super().destroy_node()
