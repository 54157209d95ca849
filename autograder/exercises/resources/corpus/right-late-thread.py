# title: A thread that closes the camera on its way out, and is not waited for
# fails: nothing


class CameraDriver(Node):
    def __init__(self, device='front'):
        super().__init__('camera_driver')
        self.tick = threading.Condition()
        self.due = 0
        self.over = False
        try:
            self.output = self.create_publisher(Image, 'camera/image', 10)
            self.camera = Camera(device)
        except OSError:
            super().destroy_node()
            raise
        try:
            self.camera.start()
        except OSError:
            self.camera.close()
            super().destroy_node()
            raise
        threading.Thread(target=self.run, daemon=True).start()
        self.create_subscription(Int32, 'camera/zoom', self.on_zoom, 10)
        self.create_service(Trigger, 'camera/snapshot', self.on_snapshot)
        self.create_timer(0.1, self.on_tick)

    def on_tick(self):
        with self.tick:
            self.due += 1
            self.tick.notify()

    def run(self):
        try:
            while True:
                with self.tick:
                    self.tick.wait_for(lambda: self.due or self.over)
                    if self.over:
                        return
                    self.due -= 1
                self.shoot()
        finally:
            self.camera.close()

    def shoot(self):
        try:
            picture = self.camera.read()
            with self.tick:
                if not self.over:
                    self.output.publish(picture)
                    return True
        except OSError:
            pass
        return False

    def on_zoom(self, message):
        if message.data in Camera.ZOOM:
            self.camera.zoom(message.data)

    def on_snapshot(self, request, response):
        response.success = self.shoot()
        return response

    def destroy_node(self):
        with self.tick:
            self.over = True
            self.tick.notify()
        super().destroy_node()


# %% resources-lifecycle
class ManagedCamera(LifecycleNode):
    """Ends finalized after an error: its on_error says that it cannot be repaired."""

    def __init__(self):
        super().__init__('managed_camera', namespace='robot')
        self.declare_parameter('device', 'front')
        self.declare_parameter('rate', 10.0)
        self.things = []

    def on_configure(self, state):
        rate = self.get_parameter('rate').get_parameter_value().double_value
        device = self.get_parameter('device').get_parameter_value().string_value
        if not 0 < rate <= 30:
            self.get_logger().error('no such rate')
            return TransitionCallbackReturn.FAILURE
        try:
            camera = Camera(device)
        except OSError:
            return TransitionCallbackReturn.FAILURE
        output = self.create_lifecycle_publisher(Image, '/camera/image', 10)
        self.things = [camera, output, rate]
        return super().on_configure(state)

    def on_activate(self, state):
        camera, output, rate = self.things
        camera.start()
        self.beat = self.create_timer(1 / rate, lambda: output.publish(camera.read()))
        return super().on_activate(state)

    def on_deactivate(self, state):
        self.destroy_timer(self.beat)
        self.things[0].stop()
        return super().on_deactivate(state)

    def give_back(self):
        if getattr(self, 'beat', None):
            self.destroy_timer(self.beat)
            self.beat = None
        if self.things:
            self.things[0].close()
            self.destroy_lifecycle_publisher(self.things[1])
            self.things = []

    def on_cleanup(self, state):
        self.give_back()
        return TransitionCallbackReturn.SUCCESS

    def on_shutdown(self, state):
        self.give_back()
        return TransitionCallbackReturn.SUCCESS

    def on_error(self, state):
        self.give_back()
        return TransitionCallbackReturn.FAILURE

    def destroy_node(self):
        self.give_back()
        super().destroy_node()
