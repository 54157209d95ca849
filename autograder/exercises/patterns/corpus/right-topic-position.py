# title: The position as a topic, as odometry is; chosen so, too
# fails: nothing

class RobotInterface(Robot):
    def __init__(self):
        super().__init__("robot_interface")
        self.odometry = self.create_publisher(Float64, "robot/position", 10)
        self.create_timer(0.2, self.position_changed)
        self.cam = self.create_publisher(Image, "robot/camera", 10)
        self.create_timer(0.1, lambda: self.cam.publish(self.take_picture()))
        self.bat = self.create_publisher(BatteryState, "robot/battery", 1)
        self.create_timer(0.9, self.charge_changed)
        limits = FloatingPointRange(from_value=0.1, to_value=1.0)
        self.declare_parameter(
            "max_speed", 0.5, ParameterDescriptor(floating_point_range=[limits])
        )
        self.nav = ActionServer(
            self,
            Fibonacci,
            "robot/navigate",
            self.go,
            cancel_callback=lambda _: CancelResponse.ACCEPT,
        )

    def position_changed(self):
        self.odometry.publish(Float64(data=self.position))

    def charge_changed(self):
        self.bat.publish(BatteryState(percentage=self.charge))

    def go(self, goal):
        passed = [int(self.position)]
        self.drive(self.get_parameter("max_speed").value)
        try:
            while passed[-1] < goal.request.order:
                if goal.is_cancel_requested:
                    goal.canceled()
                    return Fibonacci.Result(sequence=passed)
                if int(self.position) > passed[-1]:
                    passed.append(passed[-1] + 1)
                    goal.publish_feedback(Fibonacci.Feedback(sequence=passed))
                time.sleep(0.02)
            goal.succeed()
            return Fibonacci.Result(sequence=passed)
        finally:
            self.drive(0.0)


# %% patterns-answers
choices = {
    "position": "Topic",
    "camera": "topic",
    "navigation": "action",
    "parameters": "service ",
    "battery": "topic",
}
