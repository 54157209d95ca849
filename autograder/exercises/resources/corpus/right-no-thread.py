# title: No thread of its own, and a stack that knows what to give back
# fails: nothing

from contextlib import ExitStack


class CameraDriver(Node):
    def __init__(self, device='front'):
        super().__init__('eye')
        self.stack = ExitStack()
        self.stack.callback(super().destroy_node)
        with ExitStack() as undo:
            undo.push(self.stack.__exit__)
            self.camera = Camera(device)
            self.stack.callback(self.camera.close)
            self.camera.start()
            self.pictures = self.create_publisher(Image, '/camera/image', 5)
            self.create_timer(0.1, self.take)
            self.create_subscription(Int32, '/camera/zoom', lambda m: self.camera.zoom(m.data), 5)
            self.create_service(Trigger, '/camera/snapshot', self.snap)
            undo.pop_all()

    def take(self):
        self.pictures.publish(self.camera.read())

    def snap(self, _, response):
        self.take()
        response.success = True
        response.message = 'click'
        return response

    def destroy_node(self):
        self.stack.close()


# %% resources-lifecycle
class ManagedCamera(LifecycleNode):
    def __init__(self):
        super().__init__('managed_eye')
        self.declare_parameters('', [('device', 'front'), ('rate', 10.0)])
        self.held = ExitStack()
        self.running = ExitStack()

    def on_configure(self, state):
        rate = self.get_parameter('rate').value
        if rate <= 0 or rate > 30:
            return TransitionCallbackReturn.FAILURE
        # What raises here leads to on_error, and from there to unconfigured.
        self.camera = Camera(self.get_parameter('device').value)
        self.held.callback(self.camera.close)
        self.period = 1 / rate
        self.output = self.create_publisher(Image, 'camera/image', 10)
        self.held.callback(self.destroy_publisher, self.output)
        return TransitionCallbackReturn.SUCCESS

    def on_activate(self, state):
        self.camera.start()
        self.running.callback(self.camera.stop)
        timer = self.create_timer(self.period, lambda: self.output.publish(self.camera.read()))
        self.running.callback(self.destroy_timer, timer)
        return TransitionCallbackReturn.SUCCESS

    def on_deactivate(self, state):
        self.running.close()
        return TransitionCallbackReturn.SUCCESS

    def on_cleanup(self, state):
        self.running.close()
        self.held.close()
        return TransitionCallbackReturn.SUCCESS

    on_shutdown = on_error = on_cleanup

    def destroy_node(self):
        self.on_cleanup(None)
        super().destroy_node()
