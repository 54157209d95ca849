# title: A driver that spins a second node in an executor of its own
# fails: nothing

from rclpy.executors import SingleThreadedExecutor


class CameraDriver(Node):
    """The service has a node and a thread of its own, so that a long exposure holds up nobody."""

    def __init__(self, device='front'):
        super().__init__('camera_driver')
        self.service_node = self.executor_thread = self.own_executor = self.camera = None
        try:
            self.camera = Camera(device)
            self.camera.start()
            self.publisher = self.create_publisher(Image, 'camera/image', 10)
            self.service_node = Node('camera_snapshot', context=self.context)
            self.service_node.create_service(Trigger, 'camera/snapshot', self.snapshot)
            self.own_executor = SingleThreadedExecutor(context=self.context)
            self.own_executor.add_node(self.service_node)
            self.executor_thread = threading.Thread(target=self.own_executor.spin, daemon=True)
            self.executor_thread.start()
            self.create_timer(0.1, self.shoot)
            self.create_subscription(Int32, 'camera/zoom', self.zoom, 10)
        except BaseException:
            self.destroy_node()
            raise

    def shoot(self):
        try:
            self.publisher.publish(self.camera.read())
            return True
        except OSError:
            return False

    def zoom(self, message):
        self.camera.zoom(message.data)

    def snapshot(self, request, response):
        response.success = self.shoot()
        return response

    def destroy_node(self):
        if self.camera is not None:
            self.camera.close()
        if self.own_executor is not None:
            self.own_executor.shutdown()
            self.executor_thread.join()
            self.own_executor = None
        if self.service_node is not None:
            self.service_node.destroy_node()
            self.service_node = None
        super().destroy_node()


# %% resources-lifecycle
class ManagedCamera(LifecycleNode):
    def __init__(self):
        super().__init__('managed_camera')
        self.declare_parameter('device', 'front')
        self.declare_parameter('rate', 10.0)
        self.reset()

    def reset(self):
        self.camera = None
        self.worker = None
        self.jobs = None
        self.timer = None
        self.pub = None

    def on_configure(self, state):
        rate = self.get_parameter('rate').value
        if not 0 < rate <= 30:
            raise ValueError(f'rate {rate}')
        self.camera = Camera(self.get_parameter('device').value)
        self.pub = self.create_lifecycle_publisher(Image, 'camera/image', 10)
        self.period = 1.0 / rate
        return super().on_configure(state)

    def on_activate(self, state):
        self.camera.start()
        self.jobs = queue.Queue()
        self.worker = threading.Thread(target=self.work, args=(self.jobs,), daemon=True)
        self.worker.start()
        self.timer = self.create_timer(self.period, lambda: self.jobs.put(True))
        return super().on_activate(state)

    def work(self, jobs):
        while jobs.get():
            self.pub.publish(self.camera.read())

    def on_deactivate(self, state):
        self.halt()
        return super().on_deactivate(state)

    def halt(self):
        if self.timer is not None:
            self.destroy_timer(self.timer)
            self.timer = None
        if self.worker is not None:
            self.jobs.put(False)
            self.worker.join()
            self.worker = None
        if self.camera is not None:
            self.camera.stop()

    def release(self, state=None):
        self.halt()
        if self.camera is not None:
            self.camera.close()
        if self.pub is not None:
            self.destroy_lifecycle_publisher(self.pub)
        self.reset()
        return TransitionCallbackReturn.SUCCESS

    on_cleanup = on_shutdown = on_error = release

    def destroy_node(self):
        self.release()
        super().destroy_node()
