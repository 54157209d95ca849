# title: One condition between callbacks and a thread; a snapshot waits with a time-out, and looks
# fails: nothing

from rclpy.callback_groups import ReentrantCallbackGroup


class CameraDriver(Node):
    def __init__(self, device="front"):
        self.lens, self.reader, self.wanted, self.taken, self.ending = None, None, 0, 0, False
        self.news = threading.Condition()
        super().__init__("waiting_camera")
        started = False
        try:
            group = ReentrantCallbackGroup()
            self.lens = Camera(device)
            self.lens.start()
            self.pictures = self.create_publisher(Image, "camera/image", 2)
            self.create_subscription(
                Int32, "camera/zoom", lambda m: self.lens.zoom(m.data), 1, callback_group=group
            )
            self.create_service(Trigger, "camera/snapshot", self.wait_for_one, callback_group=group)
            self.create_timer(0.1, self.want_one, callback_group=group)
            self.reader = threading.Thread(target=self.read_on, name="reader")
            self.reader.start()
            started = True
        finally:
            if not started:
                self.destroy_node()

    def want_one(self):
        with self.news:
            self.wanted += 1
            self.news.notify_all()
            return self.wanted

    def wait_for_one(self, _request, response):
        number = self.want_one()
        with self.news:
            while self.taken < number and not self.ending:
                self.news.wait(0.5)
            response.success = self.taken >= number
        return response

    def read_on(self):
        while True:
            with self.news:
                self.news.wait_for(lambda: self.ending or self.taken < self.wanted)
                if self.ending:
                    return
            try:
                self.pictures.publish(self.lens.read())
            except OSError:
                return
            with self.news:
                self.taken += 1
                self.news.notify_all()

    def destroy_node(self):
        with self.news:
            self.ending = True
            self.news.notify_all()
        if self.lens is not None:
            self.lens.close()
        if self.reader is not None and self.reader is not threading.current_thread():
            self.reader.join()
        super().destroy_node()


# %% resources-lifecycle
class ManagedCamera(LifecycleNode):
    """The picture comes from a thread that lives while the node is active."""

    camera = publisher = timer = None

    def __init__(self, **options):
        super().__init__("camera_manager", **options)
        self.declare_parameter("device", "front")
        self.declare_parameter("rate", 10.0)

    def on_configure(self, previous):
        device, rate = (self.get_parameter(name).value for name in ("device", "rate"))
        if not 0 < rate <= 30:
            return TransitionCallbackReturn.FAILURE
        try:
            self.camera = Camera(device)
        except OSError as error:
            self.get_logger().warning(f"no camera: {error}")
            return TransitionCallbackReturn.FAILURE
        self.rate = rate
        self.publisher = self.create_lifecycle_publisher(Image, "camera/image", 3)
        return super().on_configure(previous)

    def on_activate(self, previous):
        self.camera.start()
        self.ticks = queue.Queue()
        self.worker = threading.Thread(target=self.work, args=(self.ticks,), daemon=True)
        self.worker.start()
        self.timer = self.create_timer(1 / self.rate, lambda: self.ticks.put(True))
        return super().on_activate(previous)

    def work(self, ticks):
        while ticks.get():
            self.publisher.publish(self.camera.read())

    def on_deactivate(self, previous):
        self.rest()
        return super().on_deactivate(previous)

    def rest(self):
        if self.timer is not None:
            self.destroy_timer(self.timer)
            self.timer = None
            self.ticks.put(False)
            self.worker.join()
        if self.camera is not None:
            self.camera.stop()

    def release(self):
        self.rest()
        if self.camera is not None:
            self.camera.close()
            self.destroy_lifecycle_publisher(self.publisher)
            self.camera = self.publisher = None
        return TransitionCallbackReturn.SUCCESS

    def on_cleanup(self, previous):
        return self.release()

    def on_shutdown(self, previous):
        return self.release()

    def on_error(self, previous):
        return self.release()

    def destroy_node(self):
        self.release()
        super().destroy_node()
