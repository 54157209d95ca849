# title: The callbacks of position, goal and cancel request wait by the node's clock before they answer
# fails: nothing

class RobotInterface(Robot):
    """The robot as the rest of the system sees it: each thing by the pattern that fits it."""

    def __init__(self):
        super().__init__('robot_interface')
        self.create_service(
            Trigger, 'robot/position', self.answer_position, callback_group=ReentrantCallbackGroup()
        )

        self.camera = self.create_publisher(Image, 'robot/camera', qos_profile_sensor_data)
        self.create_timer(0.1, self.publish_picture)

        limits = FloatingPointRange(from_value=0.1, to_value=1.0)
        described = ParameterDescriptor(floating_point_range=[limits])
        self.declare_parameter('max_speed', 0.5, described)

        # Durable: a node that joins late is handed the last level at once.
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.battery = self.create_publisher(BatteryState, 'robot/battery', latched)

        self.navigation = ActionServer(
            self,
            Fibonacci,
            'robot/navigate',
            self.navigate,
            goal_callback=self.check_brakes,
            cancel_callback=self.call_off,
            callback_group=ReentrantCallbackGroup(),
        )

    def wait(self, seconds):
        self.get_clock().sleep_for(Duration(seconds=seconds), context=self.context)

    def answer_position(self, request, response):
        self.wait(0.1)
        response.success, response.message = True, f'{self.position:.2f}'
        return response

    def publish_picture(self):
        self.camera.publish(self.take_picture())

    def charge_changed(self):
        self.battery.publish(BatteryState(percentage=self.charge))

    def check_brakes(self, goal):
        self.wait(0.2)
        return GoalResponse.ACCEPT

    def call_off(self, goal_handle):
        for part in (0.6, 0.3, 0.0):
            self.drive(part * self.get_parameter('max_speed').value)
            self.wait(0.1)
        return CancelResponse.ACCEPT

    def navigate(self, goal_handle):
        station, passed = int(self.position), []
        self.drive(self.get_parameter('max_speed').value)
        while station < goal_handle.request.order and not goal_handle.is_cancel_requested:
            if int(self.position) > station:
                station += 1
                passed.append(station)
                goal_handle.publish_feedback(Fibonacci.Feedback(sequence=passed))
            time.sleep(0.01)
        self.drive(0.0)
        if goal_handle.is_cancel_requested:
            goal_handle.canceled()
        else:
            goal_handle.succeed()
        return Fibonacci.Result(sequence=passed)


# %% patterns-answers
choices = {
    "position": "service",
    "camera": "topic",
    "navigation": "action",
    "parameters": "service",
    "battery": "topic",
}
