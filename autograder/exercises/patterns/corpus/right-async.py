# title: async: the action awaits a future that the position and the cancel request complete
# fails: nothing

from rclpy.task import Future


class RobotInterface(Robot):
    def __init__(self):
        super().__init__("robot_interface")
        self.something_happened = Future()
        self.create_service(Trigger, "robot/position", self.tell)
        self.cam = self.create_publisher(Image, "robot/camera", qos_profile_sensor_data)
        self.create_timer(0.1, self.film)
        keep_last = QoSProfile(
            history=HistoryPolicy.KEEP_LAST,
            depth=1,
            reliability=ReliabilityPolicy.RELIABLE,
            durability=DurabilityPolicy.TRANSIENT_LOCAL,
        )
        self.bat = self.create_publisher(BatteryState, "robot/battery", keep_last)
        self.declare_parameter("max_speed", 0.5)
        self.add_on_set_parameters_callback(self.check)
        self.nav = ActionServer(
            self, Fibonacci, "robot/navigate", self.drive_to, cancel_callback=self.cancel
        )

    async def tell(self, _, response):
        response.success, response.message = True, repr({"x": self.position})
        return response

    async def film(self):
        self.cam.publish(self.take_picture())

    def wake(self):
        done, self.something_happened = self.something_happened, Future()
        done.set_result(True)

    def position_changed(self):
        self.wake()

    def charge_changed(self):
        self.bat.publish(BatteryState(percentage=self.charge))

    def check(self, parameters):
        for p in parameters:
            if p.name == "max_speed" and (p.value < 0.1 or p.value > 1):
                return SetParametersResult(successful=False, reason=f"{p.value} is no good")
        return SetParametersResult(successful=True)

    def cancel(self, goal):
        # The goal is marked as cancelling only after this returns: a timer wakes the action then.
        self.drive(0.0)
        self.waker = self.create_timer(0.02, self.once)
        return CancelResponse.ACCEPT

    def once(self):
        self.waker.cancel()
        self.wake()

    async def drive_to(self, goal):
        passed = []
        position = int(self.position)
        self.drive(self.get_parameter("max_speed").value)
        while position < goal.request.order:
            await self.something_happened
            if goal.is_cancel_requested:
                self.drive(0.0)
                goal.canceled()
                return Fibonacci.Result(sequence=passed)
            if int(self.position) > position:
                position = int(self.position)
                passed.append(position)
                goal.publish_feedback(Fibonacci.Feedback(sequence=passed))
        self.drive(0.0)
        goal.succeed()
        return Fibonacci.Result(sequence=passed)


# %% patterns-answers
choices = {
    "position": "service",
    "camera": "topic",
    "navigation": "action",
    "parameters": "service",
    "battery": "topic",
}
