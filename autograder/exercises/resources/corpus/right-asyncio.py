# title: An asyncio loop in a thread reads the camera; futures go from the callbacks to it
# fails: nothing

import asyncio
from concurrent.futures import Future


class CameraDriver(Node):
    loop = thread = camera = None
    over = False

    def __init__(self, device="front"):
        self.gate = threading.Lock()
        super().__init__("aio_camera")
        try:
            self.camera = Camera(device)
            self.camera.start()
            self.out = self.create_publisher(Image, "camera/image", 10)
            self.create_subscription(Int32, "camera/zoom", self.on_zoom, 10)
            self.create_service(Trigger, "camera/snapshot", self.on_snapshot)
            self.loop = asyncio.new_event_loop()
            self.thread = threading.Thread(target=self.loop.run_forever, daemon=True)
            self.thread.start()
            self.create_timer(0.1, self.on_timer)
        except BaseException:
            self.destroy_node()
            raise

    async def picture(self):
        try:
            image = self.camera.read()
        except OSError:
            return False
        self.out.publish(image)
        return True

    def order(self):
        with self.gate:
            if not self.over:
                return asyncio.run_coroutine_threadsafe(self.picture(), self.loop)
        refused = Future()
        refused.set_result(False)
        return refused

    def on_timer(self):
        self.order()

    def on_zoom(self, message):
        self.camera.zoom(message.data)

    def on_snapshot(self, request, response):
        response.success = self.order().result()
        return response

    def destroy_node(self):
        if self.camera is not None:
            self.camera.close()  # whoever waits for a picture goes on with an error
        with self.gate:
            self.over = True
        if self.thread is not None:
            # Behind every order, all of which are in the loop by now: none is left unanswered.
            self.loop.call_soon_threadsafe(self.loop.stop)
            self.thread.join()
            self.loop.run_until_complete(asyncio.sleep(0))
            self.loop.close()
            self.thread = None
        super().destroy_node()


# %% resources-lifecycle
class ManagedCamera(LifecycleNode):
    """What it holds is in a dictionary: what is not in it is not held."""

    def __init__(self):
        self.held = {}
        super().__init__("managed_aio_camera")
        self.declare_parameters("", [("device", "front"), ("rate", 10.0)])

    def on_configure(self, state):
        rate = self.get_parameter("rate").value
        if rate <= 0.0 or rate > 30.0:
            return TransitionCallbackReturn.FAILURE
        try:
            self.held["camera"] = Camera(self.get_parameter("device").value)
        except OSError:
            return TransitionCallbackReturn.FAILURE
        self.held["publisher"] = self.create_publisher(Image, "camera/image", 5)
        self.period = 1.0 / rate
        return TransitionCallbackReturn.SUCCESS

    def on_activate(self, state):
        try:
            self.held["camera"].start()
        except OSError:
            return TransitionCallbackReturn.ERROR
        self.held["timer"] = self.create_timer(self.period, self.shoot)
        return TransitionCallbackReturn.SUCCESS

    def shoot(self):
        self.held["publisher"].publish(self.held["camera"].read())

    def on_deactivate(self, state):
        self.destroy_timer(self.held.pop("timer"))
        self.held["camera"].stop()
        return TransitionCallbackReturn.SUCCESS

    def give_back(self, state=None):
        if timer := self.held.pop("timer", None):
            self.destroy_timer(timer)
        if camera := self.held.pop("camera", None):
            camera.close()
        if publisher := self.held.pop("publisher", None):
            self.destroy_publisher(publisher)
        return TransitionCallbackReturn.SUCCESS

    on_cleanup = on_shutdown = on_error = give_back

    def destroy_node(self):
        self.give_back()
        super().destroy_node()
