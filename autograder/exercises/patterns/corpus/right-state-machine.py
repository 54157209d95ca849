# title: A drive is a state that one timer looks at; the goal is executed when it is over
# fails: nothing

class RobotInterface(Robot):
    def __init__(self):
        super().__init__("line_robot")
        beside = ReentrantCallbackGroup()
        self.ticks, self.goal, self.station, self.passed = 0, None, 0, []
        self.create_service(Trigger, "robot/position", self.where, callback_group=beside)
        self.eye = self.create_publisher(Image, "robot/camera", 1)
        # Best effort and volatile, but told again twice a second.
        self.battery = self.create_publisher(
            BatteryState, "robot/battery", qos_profile_sensor_data
        )
        self.declare_parameter("max_speed", 0.5)
        self.add_on_set_parameters_callback(self.allow)
        self.server = ActionServer(
            self,
            Fibonacci,
            "robot/navigate",
            execute_callback=self.finish,
            goal_callback=self.admit,
            handle_accepted_callback=self.begin,
            cancel_callback=lambda _: CancelResponse.ACCEPT,
            callback_group=beside,
        )
        self.create_timer(0.05, self.tick, callback_group=MutuallyExclusiveCallbackGroup())

    def where(self, request, response):
        response.success = True
        response.message = f"x = {self.position:.3f} m"
        return response

    def allow(self, parameters):
        for parameter in parameters:
            if parameter.name == "max_speed" and not 0.1 <= parameter.value <= 1.0:
                return SetParametersResult(successful=False, reason="from 0.1 to 1.0 m/s, please")
        return SetParametersResult(successful=True)

    def tick(self):
        self.ticks += 1
        if self.ticks % 2 == 0:
            self.eye.publish(self.take_picture())
        if self.ticks % 10 == 0:
            self.charge_changed()
        if self.goal is not None:
            self.look_around(self.goal)

    def charge_changed(self):
        self.battery.publish(BatteryState(percentage=self.charge))

    def admit(self, goal):
        return GoalResponse.ACCEPT if self.goal is None else GoalResponse.REJECT

    def begin(self, goal):
        self.station, self.passed = int(self.position), []
        self.drive(self.get_parameter("max_speed").value)
        self.goal = goal

    def look_around(self, goal):
        while self.station < min(int(self.position), goal.request.order):
            self.station += 1
            self.passed.append(self.station)
            goal.publish_feedback(Fibonacci.Feedback(sequence=self.passed))
        if goal.is_cancel_requested or self.station >= goal.request.order:
            self.goal = None
            self.drive(0.0)
            goal.execute()

    def finish(self, goal):
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
