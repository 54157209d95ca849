# title: An async snapshot shares its group with the zoom and awaits a thread; the timer has a group of its own
# fails: nothing
import weakref
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.task import Future


def work(camera, jobs, out):
    for job in iter(jobs.get, None):
        try:
            out.publish(camera.read())
            ok = True
        except Exception:
            ok = False
        if job is not True:
            job.set_result(ok)


def ask(jobs, ref):
    if ref() is not None and jobs.empty():  # a camera that is behind gets no more orders
        jobs.put(True)


class CameraDriver(Node):
    thread = None
    camera = None
    dead = False

    def __init__(self, device='front'):
        super().__init__('camera_driver')
        self.jobs = queue.Queue(maxsize=4)
        try:
            self.camera = Camera(device)
            self.camera.start()
            self.out = self.create_publisher(Image, 'camera/image', 10)
            self.create_subscription(Int32, 'camera/zoom', self.zoomed, 10)
            self.create_service(Trigger, 'camera/snapshot', self.snapshot)
            self.thread = threading.Thread(target=work, args=(self.camera, self.jobs, self.out), daemon=True)
            self.thread.start()
            ref, jobs = weakref.ref(self), self.jobs
            self.create_timer(0.1, lambda: ask(jobs, ref), callback_group=MutuallyExclusiveCallbackGroup())
        except Exception as e:
            self.destroy_node()
            raise RuntimeError(f'no driver for {device}') from e

    def zoomed(self, message):
        try:
            self.camera.zoom(message.data)
        except ValueError as e:
            self.get_logger().warn(str(e))

    async def snapshot(self, request, response):
        job = Future(executor=self.executor)
        self.jobs.put(job)
        response.success = await job
        return response

    def destroy_node(self):
        if self.camera is not None:
            self.camera.close()
        if self.thread is not None:
            self.jobs.put(None)
            self.thread.join()
            self.thread = None
            while not self.jobs.empty():  # nobody waits for ever
                job = self.jobs.get()
                if isinstance(job, Future):
                    job.set_result(False)
        super().destroy_node()


# %% resources-lifecycle
class ManagedCamera(LifecycleNode):
    def __init__(self):
        self.camera = self.pub = self.timer = self.thread = None
        super().__init__('managed_camera')
        self.declare_parameter('device', 'front')
        self.declare_parameter('rate', 10.0)

    def on_configure(self, state):
        rate = self.get_parameter('rate').value
        if rate <= 0 or rate > 30:
            return TransitionCallbackReturn.FAILURE
        self.period = 1 / rate
        try:
            self.camera = Camera(self.get_parameter('device').value)
            self.pub = self.create_publisher(Image, 'camera/image', 10)
        except OSError:
            return TransitionCallbackReturn.FAILURE
        return TransitionCallbackReturn.SUCCESS

    def on_activate(self, state):
        self.camera.start()
        self.jobs = queue.Queue()
        self.thread = threading.Thread(target=work, args=(self.camera, self.jobs, self.pub), daemon=True)
        self.thread.start()
        self.timer = self.create_timer(self.period, lambda: self.jobs.put(True))
        return TransitionCallbackReturn.SUCCESS

    def halt(self):
        if self.timer is not None:
            self.destroy_timer(self.timer)
            self.timer = None
        if self.camera is not None:
            self.camera.stop()
        if self.thread is not None:
            self.jobs.put(None)
            self.thread.join()
            self.thread = None

    def on_deactivate(self, state):
        self.halt()
        return TransitionCallbackReturn.SUCCESS

    def on_cleanup(self, state):
        self.halt()
        if self.camera is not None:
            self.camera.close()
            self.camera = None
        if self.pub is not None:
            self.destroy_publisher(self.pub)
            self.pub = None
        return TransitionCallbackReturn.SUCCESS

    def on_shutdown(self, state):
        return self.on_cleanup(state)

    def on_error(self, state):
        return self.on_cleanup(state)

    def destroy_node(self):
        self.on_cleanup(None)
        super().destroy_node()
