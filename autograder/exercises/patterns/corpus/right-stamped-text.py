# title: The position service says when, too: an ISO time and the metres
# fails: nothing

import datetime


class RobotInterface(Robot):
    def __init__(self):
        super().__init__("robot_interface")
        self.create_service(Trigger, "robot/position", self.tell)
        self.cam = self.create_publisher(Image, "robot/camera", qos_profile_sensor_data)
        self.create_timer(0.1, lambda: self.cam.publish(self.take_picture()))
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.bat = self.create_publisher(BatteryState, "robot/battery", latched)
        self.limit = 0.5
        self.create_service(SetParameters, "robot/max_speed", self.on_set)
        self.nav = ActionServer(
            self,
            Fibonacci,
            "robot/navigate",
            self.navigate,
            cancel_callback=lambda _: CancelResponse.ACCEPT,
        )

    def tell(self, _, response):
        now = self.get_clock().now().nanoseconds / 1e9
        when = datetime.datetime.fromtimestamp(now, datetime.timezone.utc)
        text = f"{when:%Y-%m-%d %H:%M:%S} position {self.position:.2f} m"
        return Trigger.Response(success=True, message=text)

    def charge_changed(self):
        self.bat.publish(BatteryState(percentage=self.charge))

    def on_set(self, request, response):
        def one(p):
            if p.name == "max_speed" and 0.1 <= p.value.double_value <= 1.0:
                self.limit = p.value.double_value
                return SetParametersResult(successful=True, reason="as you like")
            return SetParametersResult(successful=False, reason="max_speed: 0.1 to 1.0")

        response.results = [one(p) for p in request.parameters]
        return response

    def navigate(self, goal):
        stations = iter(range(int(self.position) + 1, goal.request.order + 1))
        passed = set()
        self.drive(self.limit)
        for station in stations:
            while self.position < station:
                if goal.is_cancel_requested:
                    self.drive(0.0)
                    goal.canceled()
                    return Fibonacci.Result(sequence=sorted(passed))
                time.sleep(0.01)
            passed.add(station)
            if station == goal.request.order:
                self.drive(0.0)
            goal.publish_feedback(Fibonacci.Feedback(sequence=sorted(passed)))
        goal.succeed()
        return Fibonacci.Result(sequence=sorted(passed))


# %% patterns-answers
choices = {
    "position": "service",
    "camera": "topic",
    "navigation": "action",
    "parameters": "service",
    "battery": "topic",
}
