# title: async snapshot in a group of its own (MutuallyExclusive) awaits a worker thread; managed: callbacks registered, not overridden
# fails: nothing
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.task import Future


class CameraDriver(Node):
    def __init__(self, device='front'):
        super().__init__('await_camera')
        self.camera = self.worker = None
        self.jobs = queue.Queue(maxsize=8)
        try:
            self.camera = Camera(device)
            self.camera.start()
            self.out = self.create_publisher(Image, 'camera/image', 10)
            self.worker = threading.Thread(target=self.work)
            self.worker.start()
            self.create_timer(0.1, self.tick, callback_group=MutuallyExclusiveCallbackGroup())
            self.create_subscription(Int32, 'camera/zoom', self.on_zoom, 10, callback_group=MutuallyExclusiveCallbackGroup())
            self.create_service(Trigger, 'camera/snapshot', self.snap, callback_group=MutuallyExclusiveCallbackGroup())
        except BaseException:
            self.destroy_node()
            raise

    def tick(self):
        if self.jobs.empty():
            self.jobs.put(None)

    def on_zoom(self, message):
        self.camera.zoom(message.data)

    async def snap(self, request, response):
        done = Future(executor=self.executor)
        self.jobs.put(done)
        response.success = await done
        return response

    def work(self):
        while (job := self.jobs.get()) != 'end':
            try:
                self.out.publish(self.camera.read())
                good = True
            except OSError:
                good = False
            if job is not None:
                job.set_result(good)

    def destroy_node(self):
        if self.camera is not None:
            self.camera.close()
        if self.worker is not None:
            self.jobs.put('end')
            self.worker.join()
            self.worker = None
            while not self.jobs.empty():
                job = self.jobs.get()
                if isinstance(job, Future):
                    job.set_result(False)
        super().destroy_node()


# %% resources-lifecycle
OK = TransitionCallbackReturn.SUCCESS


class ManagedCamera(LifecycleNode):
    """Registers what the others override."""

    def __init__(self):
        for name in ('configure', 'activate', 'deactivate', 'cleanup', 'shutdown', 'error'):
            setattr(self, f'on_{name}', getattr(self, name))
        super().__init__('slow_manager')
        self.declare_parameters('', [('device', 'front'), ('rate', 10.0)])
        self.camera = self.output = self.timer = None

    def configure(self, state):
        self.rate = self.get_parameter('rate').value
        if self.rate <= 0 or self.rate > 30:
            return TransitionCallbackReturn.FAILURE
        try:
            self.camera = Camera(self.get_parameter('device').value)
        except OSError:
            return TransitionCallbackReturn.FAILURE
        self.output = self.create_publisher(Image, 'camera/image', 10)
        return OK

    def activate(self, state):
        try:
            self.camera.start()
        except OSError:
            return TransitionCallbackReturn.ERROR
        self.timer = self.create_timer(1 / self.rate, self.shoot)
        return OK

    def shoot(self):
        self.output.publish(self.camera.read())

    def deactivate(self, state):
        self.destroy_timer(self.timer)
        self.timer = None
        self.camera.stop()
        return OK

    def cleanup(self, state):
        if self.timer:
            self.destroy_timer(self.timer)
        if self.camera:
            self.camera.close()
        if self.output:
            self.destroy_publisher(self.output)
        self.camera = self.output = self.timer = None
        return OK

    shutdown = error = cleanup

    def destroy_node(self):
        self.cleanup(None)
        super().destroy_node()
