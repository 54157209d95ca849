# title: async: each callback awaits a sleep made of a timer and a future, the position service too
# fails: nothing

from rclpy.task import Future


class RobotInterface(Robot):
    def __init__(self):
        super().__init__("robot_interface")
        self.group = ReentrantCallbackGroup()
        self.create_service(Trigger, "robot/position", self.tell, callback_group=self.group)
        self.cam = self.create_publisher(Image, "robot/camera", qos_profile_sensor_data)
        self.create_timer(0.1, self.film, callback_group=self.group)
        self.bat = self.create_publisher(
            BatteryState,
            "robot/battery",
            QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL),
        )
        self.declare_parameter("max_speed", 0.5)
        self.add_on_set_parameters_callback(self.check)
        self.nav = ActionServer(
            self,
            Fibonacci,
            "robot/navigate",
            self.navigate,
            cancel_callback=self.allow,
            callback_group=self.group,
        )

    async def allow(self, _):
        return CancelResponse.ACCEPT

    async def sleep(self, seconds):
        future = Future(executor=self.executor)
        timer = self.create_timer(
            seconds,
            lambda: None if future.done() else future.set_result(None),
            callback_group=self.group,
        )
        await future
        timer.cancel()
        self.destroy_timer(timer)

    async def tell(self, _, response):
        await self.sleep(0.05)  # the odometer is a little slow
        response.success = True
        response.message = f"{self.position:+.2f}"
        return response

    async def film(self):
        self.cam.publish(self.take_picture())

    def charge_changed(self):
        self.bat.publish(BatteryState(percentage=self.charge))

    def check(self, parameters):
        for p in parameters:
            if p.name == "max_speed" and not 0.1 <= p.value <= 1.0:
                return SetParametersResult(successful=False, reason="outside 0.1 to 1.0")
        return SetParametersResult(successful=True)

    async def navigate(self, goal):
        passed, here, speed = [], int(self.position), 0.0
        while here < goal.request.order and not goal.is_cancel_requested:
            limit = self.get_parameter("max_speed").value
            if limit != speed:
                speed = limit
                self.drive(speed)
            await self.sleep(0.1)
            while here < min(int(self.position), goal.request.order):
                here += 1
                passed.append(here)
                goal.publish_feedback(Fibonacci.Feedback(sequence=passed))
        self.drive(0.0)
        if here >= goal.request.order:
            goal.succeed()
        else:
            goal.canceled()
        return Fibonacci.Result(sequence=passed)


# %% patterns-answers
choices = {
    "position": "service",
    "camera": "topic",
    "navigation": "action",
    "parameters": "service",
    "battery": "topic",
}
