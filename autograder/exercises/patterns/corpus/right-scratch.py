# title: From scratch: a plain Node of another name, absolute topics, polling in the action
# fails: nothing

class RobotInterface(Node):
    def __init__(self):
        super().__init__("r2", namespace="/fleet")
        self.x = 0.0
        self.soc = None
        group = ReentrantCallbackGroup()
        self.create_subscription(Float64, "/hardware/position", self.on_x, qos_profile_sensor_data)
        self.create_subscription(Float64, "/hardware/charge", self.on_soc, 1)
        self.motor = self.create_publisher(Float64, "/hardware/speed", 1)
        self.srv = self.create_service(Trigger, "/robot/position", self.where)
        self.cam = self.create_publisher(Image, "/robot/camera", 1)
        self.bat = self.create_publisher(BatteryState, "/robot/battery", 10)
        self.create_timer(0.1, self.tick)
        self.create_timer(0.5, self.send_level)
        self.declare_parameter("max_speed", 0.5)
        self.add_on_set_parameters_callback(self.on_set)
        self.server = ActionServer(
            self,
            Fibonacci,
            "/robot/navigate",
            execute_callback=self.go,
            goal_callback=self.on_goal,
            cancel_callback=lambda handle: CancelResponse.ACCEPT,
            callback_group=group,
        )

    def on_x(self, msg):
        self.x = msg.data

    def on_soc(self, msg):
        self.soc = msg.data

    def where(self, request, response):
        response.message = f"The robot is at {self.x} m."
        response.success = True
        return response

    def tick(self):
        image = Image()
        image.header.stamp = self.get_clock().now().to_msg()
        image.width, image.height, image.step, image.encoding = 4, 2, 12, "rgb8"
        image.data = [0] * 24
        self.cam.publish(image)

    def send_level(self):
        if self.soc is not None:
            msg = BatteryState()
            msg.percentage = self.soc
            self.bat.publish(msg)

    def on_set(self, params):
        for p in params:
            if p.name == "max_speed" and not 0.1 <= p.value <= 1.0:
                return SetParametersResult(successful=False, reason="0.1 to 1.0 m/s, please")
        return SetParametersResult(successful=True)

    def on_goal(self, goal):
        return GoalResponse.ACCEPT if goal.order > self.x else GoalResponse.REJECT

    def go(self, handle):
        target = handle.request.order
        first = int(self.x)
        seen = [first]
        result = Fibonacci.Result()
        while True:
            here = int(self.x + 1e-9)
            if here > seen[-1]:
                seen.extend(range(seen[-1] + 1, here + 1))
            feedback = Fibonacci.Feedback()
            feedback.sequence = seen
            handle.publish_feedback(feedback)
            result.sequence = seen
            if here >= target:
                self.motor.publish(Float64(data=0.0))
                handle.succeed()
                return result
            if handle.is_cancel_requested:
                self.motor.publish(Float64(data=0.0))
                handle.canceled()
                return result
            self.motor.publish(Float64(data=self.get_parameter("max_speed").value))
            time.sleep(0.05)


# %% patterns-answers
choices = {
    "position": "service",
    "camera": "topic",
    "navigation": "action",
    "parameters": "service",
    "battery": "topic",
}
