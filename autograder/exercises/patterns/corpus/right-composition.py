# title: Composition: parts that hold the node, one callback group each
# fails: nothing

class Camera:
    def __init__(self, node, robot):
        self.node, self.robot = node, robot
        self.publisher = node.create_publisher(
            Image, "robot/camera", QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)
        )
        self.timer = node.create_timer(
            1 / 10, self.shoot, callback_group=MutuallyExclusiveCallbackGroup()
        )

    def shoot(self):
        self.publisher.publish(self.robot.take_picture())


class Battery:
    def __init__(self, node):
        qos = QoSProfile(depth=3, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.publisher = node.create_publisher(BatteryState, "robot/battery", qos)

    def tell(self, level):
        self.publisher.publish(BatteryState(percentage=level, present=True))


class Limits:
    def __init__(self, node):
        self.node = node
        node.declare_parameter(
            "max_speed",
            0.5,
            ParameterDescriptor(
                description="highest speed (m/s)",
                floating_point_range=[FloatingPointRange(from_value=0.1, to_value=1.0, step=0.0)],
            ),
        )
        self.value = 0.5
        node.add_post_set_parameters_callback(self.take_over)

    def take_over(self, parameters):
        for parameter in parameters:
            if parameter.name == "max_speed":
                self.value = parameter.value


class Navigator:
    def __init__(self, node, robot, limits):
        self.robot, self.limits = robot, limits
        self.moved = threading.Condition()
        self.server = ActionServer(
            node,
            Fibonacci,
            "robot/navigate",
            execute_callback=self.execute,
            cancel_callback=self.on_cancel,
            callback_group=MutuallyExclusiveCallbackGroup(),
        )

    def on_cancel(self, goal_handle):
        return CancelResponse.ACCEPT

    def notify(self):
        with self.moved:
            self.moved.notify_all()

    def execute(self, goal_handle):
        reached = []
        while not goal_handle.is_cancel_requested:
            self.robot.drive(self.limits.value)
            with self.moved:
                self.moved.wait(timeout=0.05)
            here = int(self.robot.position)
            if here > (reached[-1] if reached else 0) or not reached and here > 0:
                if not reached or here != reached[-1]:
                    reached.append(here)
                    goal_handle.publish_feedback(Fibonacci.Feedback(sequence=reached))
            if here >= goal_handle.request.order:
                self.robot.drive(0.0)
                goal_handle.succeed()
                return Fibonacci.Result(sequence=reached)
        self.robot.drive(0.0)
        goal_handle.canceled()
        return Fibonacci.Result(sequence=reached)


class RobotInterface(Robot):
    def __init__(self):
        super().__init__("parts")
        self.limits = Limits(self)
        self.eye = Camera(self, self)
        self.cells = Battery(self)
        self.pilot = Navigator(self, self, self.limits)
        self.odometer = self.create_service(Trigger, "robot/position", self.where)

    def where(self, request, response):
        return Trigger.Response(success=True, message="%.3f" % self.position)

    def position_changed(self):
        self.pilot.notify()

    def charge_changed(self):
        self.cells.tell(self.charge)


# %% patterns-answers
choices = {
    "position": "service",
    "camera": "topic",
    "navigation": "action",
    "parameters": "service",
    "battery": "topic",
}
