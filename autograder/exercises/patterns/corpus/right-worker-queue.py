# title: Mixins; accepted goals go through a queue to one worker; 20 Hz control with a ramp up and a slow approach
# fails: nothing

import queue


class Films:
    def __init__(self, *args):
        super().__init__(*args)
        self._eye = self.create_publisher(Image, "robot/camera", 5)
        self._shutter = self.create_timer(
            0.1, self._film, callback_group=MutuallyExclusiveCallbackGroup())

    def _film(self):
        self._eye.publish(self.take_picture())


class TellsLevel:
    def __init__(self, *args):
        super().__init__(*args)
        self._level = self.create_publisher(BatteryState, "robot/battery", 1)
        self.create_timer(0.5, self.charge_changed, callback_group=MutuallyExclusiveCallbackGroup())

    def charge_changed(self):
        self._level.publish(BatteryState(percentage=self.charge, present=True))


class Located:
    def __init__(self, *args):
        super().__init__(*args)
        self.create_service(
            Trigger, "robot/position", self._where, callback_group=MutuallyExclusiveCallbackGroup())

    def _where(self, _request, response):
        self.get_logger().info("somebody asks where I am")
        response.success, response.message = True, f"position: {self.position:.1f} m"
        return response


class RobotInterface(Films, TellsLevel, Located, Robot):
    def __init__(self):
        super().__init__("robot_interface")
        self.declare_parameter("max_speed", 0.5)
        self.add_on_set_parameters_callback(self._judge)
        self._goals = queue.Queue()
        self._speed = 0.0
        self._server = ActionServer(
            self, Fibonacci, "robot/navigate", self._execute,
            goal_callback=self._admit,
            handle_accepted_callback=self._goals.put,
            cancel_callback=lambda _: CancelResponse.ACCEPT,
            callback_group=MutuallyExclusiveCallbackGroup())
        self._over = {}
        self._worker = threading.Thread(target=self._work, daemon=True)
        self._worker.start()

    def _admit(self, request):
        good = request.order > self.position
        return GoalResponse.ACCEPT if good else GoalResponse.REJECT

    def _judge(self, parameters):
        for p in parameters:
            if p.name == "max_speed" and not 0.1 <= p.value <= 1.0:
                return SetParametersResult(successful=False, reason=f"{p.value} is not in [0.1, 1]")
        return SetParametersResult(successful=True)

    def _work(self):
        while True:
            goal = self._goals.get()
            self._over[bytes(goal.goal_id.uuid)] = self._travel(goal)
            goal.execute()

    def _travel(self, goal):
        passed, next_station = [], int(self.position) + 1
        while not goal.is_cancel_requested and next_station <= goal.request.order:
            if self.position >= next_station:
                passed.append(next_station)
                next_station += 1
                goal.publish_feedback(Fibonacci.Feedback(sequence=passed))
                continue
            limit = self.get_parameter("max_speed").value
            left = goal.request.order - self.position
            wanted = max(0.1, min(limit, 2 * left))
            self._speed = min(wanted, self._speed + 0.05)
            self.drive(self._speed)
            self.get_clock().sleep_for(Duration(seconds=0.05))
        self._speed = 0.0
        self.drive(0.0)
        return passed

    def _execute(self, goal):
        passed = self._over.pop(bytes(goal.goal_id.uuid))
        if goal.is_cancel_requested:
            goal.canceled()
        else:
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
