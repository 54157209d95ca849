# title: A function that makes the node, and objects that own one resource each
# fails: nothing

from rclpy.lifecycle import ManagedEntity, SimpleManagedEntity
from rclpy.qos import qos_profile_sensor_data


class Photographer:
    """A camera and the thread that reads it, to be used with `with` or close()."""

    def __init__(self, device, deliver):
        self.camera = Camera(device)
        try:
            self.camera.start()
        except OSError:
            self.camera.close()
            raise
        self.deliver = deliver
        self.wanted = threading.Semaphore(0)
        self.ended = False
        self.thread = threading.Thread(target=self.run)
        self.thread.start()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def run(self):
        while self.wanted.acquire() and not self.ended:
            try:
                self.deliver(self.camera.read())
            except OSError:
                break

    def close(self):
        self.ended = True
        self.wanted.release()
        self.camera.close()
        self.thread.join()


class _Driver(Node):
    photographer = None

    def destroy_node(self):
        if self.photographer:
            self.photographer.close()
        super().destroy_node()


def CameraDriver(device='front'):
    node = _Driver('camera_driver')
    try:
        output = node.create_publisher(Image, 'camera/image', qos_profile_sensor_data)
        node.photographer = Photographer(device, output.publish)

        def snapshot(request, response):
            output.publish(node.photographer.camera.read())
            return Trigger.Response(success=True)

        def zoom(message):
            try:
                node.photographer.camera.zoom(message.data)
            except ValueError as error:
                node.get_logger().warning(str(error))

        node.create_timer(0.1, node.photographer.wanted.release)
        node.create_service(Trigger, 'camera/snapshot', snapshot)
        node.create_subscription(Int32, 'camera/zoom', zoom, 1)
        return node
    except Exception:
        node.destroy_node()
        raise


# %% resources-lifecycle
class Stream(SimpleManagedEntity):
    """The camera as a managed entity of its own."""

    def __init__(self, node):
        super().__init__()
        self.node = node
        self.camera = self.timer = self.output = None

    def on_configure(self, state):
        self.rate = self.node.get_parameter('rate').value
        if not 0 < self.rate <= 30:
            return TransitionCallbackReturn.ERROR
        self.camera = Camera(self.node.get_parameter('device').value)
        self.output = self.node.create_publisher(Image, 'camera/image', 1)
        return super().on_configure(state)

    def on_activate(self, state):
        self.camera.start()
        self.timer = self.node.create_timer(1 / self.rate, self.send)
        return super().on_activate(state)

    def on_deactivate(self, state):
        self.timer.cancel()
        self.node.destroy_timer(self.timer)
        self.camera.stop()
        return super().on_deactivate(state)

    @SimpleManagedEntity.when_enabled
    def send(self):
        self.output.publish(self.camera.read())

    def drop(self, state):
        if self.timer:
            self.node.destroy_timer(self.timer)
        if self.camera:
            self.camera.close()
        if self.output:
            self.node.destroy_publisher(self.output)
        self.timer = self.camera = self.output = None
        return TransitionCallbackReturn.SUCCESS

    on_cleanup = on_shutdown = on_error = drop


class ManagedCamera(LifecycleNode):
    def __init__(self):
        super().__init__('managed_camera')
        self.declare_parameter('device', 'front')
        self.declare_parameter('rate', 10.0)
        self.stream = Stream(self)
        self.add_managed_entity(self.stream)

    def destroy_node(self):
        self.stream.drop(None)
        super().destroy_node()
