# title: Waits by the node's clock, in the action and in a camera thread; the level on a timer
# fails: nothing

class RobotInterface(Robot):
    def __init__(self):
        super().__init__("robot_interface")
        self.create_service(Trigger, "robot/position", self.tell)
        self.cam = self.create_publisher(Image, "robot/camera", 10)
        self.rate = self.create_rate(10)
        self.alive = True
        self.thread = threading.Thread(target=self.film, daemon=True)
        self.thread.start()
        self.bat = self.create_publisher(BatteryState, "robot/battery", 10)
        self.create_timer(1.0, self.charge_changed)
        self.declare_parameters("", [("max_speed", 0.5)])
        self.add_on_set_parameters_callback(self.check)
        self.nav = ActionServer(
            self,
            Fibonacci,
            "robot/navigate",
            self.drive_to,
            cancel_callback=lambda _: CancelResponse.ACCEPT,
        )

    def film(self):
        while self.alive and self.context.ok():
            try:
                self.rate.sleep()
                self.cam.publish(self.take_picture())
            except Exception:
                return

    def tell(self, _, response):
        response.success = True
        response.message = str(self.position)
        return response

    def charge_changed(self):
        self.bat.publish(BatteryState(percentage=self.charge))

    def check(self, parameters):
        good = all(0.1 <= p.value <= 1.0 for p in parameters if p.name == "max_speed")
        return SetParametersResult(successful=good, reason="" if good else "out of range")

    def drive_to(self, goal):
        passed = []
        start = int(self.position)
        clock = self.get_clock()
        while int(self.position) < goal.request.order:
            if goal.is_cancel_requested:
                self.drive(0)
                goal.canceled()
                return Fibonacci.Result(sequence=passed)
            self.drive(self.get_parameter("max_speed").get_parameter_value().double_value)
            clock.sleep_for(Duration(seconds=0.05), context=self.context)
            passed = list(range(start + 1, int(self.position) + 1))
            goal.publish_feedback(Fibonacci.Feedback(sequence=passed))
        self.drive(0)
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
