# title: A thread drives, and an event tells the action that it has arrived; every level is kept
# fails: nothing

class Trip(threading.Thread):
    """Drives to a station; `over` is set when the robot stands."""

    def __init__(self, robot, goal):
        super().__init__(daemon=True)
        self.robot, self.goal = robot, goal
        self.passed = []
        self.over = threading.Event()

    def run(self):
        robot, goal = self.robot, self.goal
        here = int(robot.position)
        robot.drive(robot.get_parameter("max_speed").get_parameter_value().double_value)
        while here < goal.request.order and not goal.is_cancel_requested:
            with robot.moved:
                robot.moved.wait(0.02)  # a request to cancel notifies nobody
            for station in range(here + 1, min(int(robot.position), goal.request.order) + 1):
                self.passed.append(station)
                goal.publish_feedback(Fibonacci.Feedback(sequence=self.passed))
                here = station
        robot.drive(0.0)
        self.over.set()


class RobotInterface(Robot):
    def __init__(self):
        self.moved = threading.Condition()
        super().__init__("with_threads")
        group = ReentrantCallbackGroup()
        self.create_service(Trigger, "/robot/position", self.on_ask, callback_group=group)
        self.images = self.create_publisher(
            Image,
            "/robot/camera",
            QoSProfile(depth=2, reliability=ReliabilityPolicy.RELIABLE),
        )
        self.create_timer(0.1, self.on_frame, callback_group=group)
        self.levels = self.create_publisher(
            BatteryState,
            "/robot/battery",
            QoSProfile(
                history=HistoryPolicy.KEEP_ALL,
                reliability=ReliabilityPolicy.RELIABLE,
                durability=DurabilityPolicy.TRANSIENT_LOCAL,
            ),
        )
        self.declare_parameter(
            "max_speed",
            0.5,
            ParameterDescriptor(
                floating_point_range=[FloatingPointRange(from_value=0.1, to_value=1.0)]
            ),
        )
        self.actions = ActionServer(
            self,
            Fibonacci,
            "/robot/navigate",
            self.on_goal,
            cancel_callback=lambda goal: CancelResponse.ACCEPT,
            callback_group=group,
        )

    def on_ask(self, _, response):
        response.success, response.message = True, str(round(self.position, 2))
        return response

    def on_frame(self):
        self.images.publish(self.take_picture())

    def position_changed(self):
        with self.moved:
            self.moved.notify_all()

    def charge_changed(self):
        self.levels.publish(BatteryState(percentage=self.charge, present=True))

    def on_goal(self, goal):
        trip = Trip(self, goal)
        trip.start()
        trip.over.wait()
        trip.join()
        goal.canceled() if goal.is_cancel_requested else goal.succeed()
        return Fibonacci.Result(sequence=trip.passed)


# %% patterns-answers
choices = {
    "position": "service",
    "camera": "topic",
    "navigation": "action",
    "parameters": "service",
    "battery": "topic",
}
