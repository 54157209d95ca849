# title: Parameters through a service of its own; position as service and as topic
# fails: nothing

class RobotInterface(Robot):
    def __init__(self):
        super().__init__("robot_interface", )
        self.limit = 0.5
        self.create_service(SetParameters, "robot/max_speed", self.on_set)
        self.create_service(Trigger, "robot/position", self.where)
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.odometry = self.create_publisher(Float64, "robot/position", latched)
        self.pictures = self.create_publisher(Image, "robot/camera", qos_profile_sensor_data)
        self.timer = self.create_timer(0.02, self.on_timer)
        self.ticks = 0
        self.levels = self.create_publisher(BatteryState, "robot/battery", latched)
        self.goal = None
        self.passed = []
        self.done = threading.Event()
        self.nav = ActionServer(
            self,
            Fibonacci,
            "robot/navigate",
            self.execute,
            cancel_callback=lambda _: CancelResponse.ACCEPT,
        )

    def on_set(self, request, response):
        for parameter in request.parameters:
            value = parameter.value.double_value
            good = parameter.name == "max_speed" and 0.1 <= value <= 1.0
            if good:
                self.limit = value
            reason = "" if good else f"{parameter.name} = {value} is out of range"
            response.results.append(SetParametersResult(successful=good, reason=reason))
        return response

    def where(self, request, response):
        response.success, response.message = True, f"{self.position:.3e}"
        return response

    def position_changed(self):
        self.odometry.publish(Float64(data=self.position))

    def charge_changed(self):
        self.levels.publish(BatteryState(percentage=self.charge))

    def on_timer(self):
        self.ticks += 1
        if self.ticks % 5 == 0:
            self.pictures.publish(self.take_picture())
        goal = self.goal
        if goal is None:
            return
        here = int(self.position)
        if goal.is_cancel_requested or here >= goal.request.order:
            self.passed = list(range(self.origin + 1, here + 1))
            self.goal = None
            self.drive(0.0)
            self.done.set()
            return
        # A ramp: 0.1 m/s faster each time, up to the limit.
        self.speed = min(self.limit, self.speed + 0.1)
        self.drive(self.speed)
        goal.publish_feedback(Fibonacci.Feedback(sequence=range(self.origin + 1, here + 1)))

    def execute(self, goal):
        self.origin, self.speed = int(self.position), 0.0
        self.done.clear()
        self.goal = goal
        self.done.wait()
        if goal.is_cancel_requested:
            goal.canceled()
        else:
            goal.succeed()
        return Fibonacci.Result(sequence=self.passed)


# %% patterns-answers
choices = {
    "position": "service",
    "camera": "topic",
    "navigation": "action",
    "parameters": "service",
    "battery": "topic",
}
