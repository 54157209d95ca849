# title: One timer a node looks at everything, by the node's clock; absolute names, other QoS
# fails: nothing

from rclpy.qos import QoSProfile, ReliabilityPolicy

LOOSE = QoSProfile(depth=50, reliability=ReliabilityPolicy.BEST_EFFORT)


def seconds(node):
    return node.get_clock().now().nanoseconds / 1e9


class GripperClient(Node):
    def __init__(self):
        super().__init__('grip_poller')
        self.client = self.create_client(SetBool, '/gripper/set')
        self.out = self.create_publisher(String, '/grip/outcome', LOOSE)
        self.hold = self.create_publisher(Empty, '/arm/hold', LOOSE)
        self.beat = self.create_publisher(Empty, '/grip/heartbeat', LOOSE)
        self.create_subscription(Bool, '/grip/request', self.ask, 5)
        self.state = 'idle'
        self.beats = 0
        self.create_timer(0.1, self.look)

    def ask(self, message):
        self.data, self.tries = message.data, 0
        self.state, self.since, self.length = 'pause', seconds(self), 0.0

    def say(self, word):
        if word != 'done':
            self.hold.publish(Empty())
        self.out.publish(String(data=word))
        self.state = 'idle'

    def look(self):
        now = seconds(self)
        self.beats += 1
        if self.beats % 5 == 0:
            self.beat.publish(Empty())
        if self.state == 'pause' and now - self.since >= self.length - 1e-6:
            self.tries += 1
            self.future = self.client.call_async(SetBool.Request(data=self.data))
            self.state, self.since = 'call', now
        elif self.state == 'call':
            if self.future.done():
                self.say('done' if self.future.result().success else 'refused')
            elif now - self.since >= 1.0 - 1e-6:
                self.client.remove_pending_request(self.future)
                if self.tries == 3:
                    self.say('failed')
                else:
                    self.state, self.since, self.length = 'pause', now, 0.6 * self.tries


# %% safety-speed
class SpeedServer(Node):
    def __init__(self):
        super().__init__('speed_poller')
        self.wheels = Wheels(self)
        self.now = [0.5, 1.0]
        self.create_service(SetParametersAtomically, '/speed/set', self.serve)

    def serve(self, request, response):
        result = response.result
        result.successful = False
        result.reason = 'bad request'
        wanted = list(self.now)
        names, highest = ['linear', 'angular'], [1.0, 2.0]
        if len(request.parameters) == 0:
            return response
        for parameter in request.parameters:
            if parameter.name not in names or parameter.value.type != 3:
                return response
            i = names.index(parameter.name)
            if 0 <= parameter.value.double_value <= highest[i]:
                wanted[i] = parameter.value.double_value
            else:
                return response
        try:
            self.wheels.set_limits(*wanted)
        except WheelError:
            result.reason = 'the wheels do not take it'
            return response
        self.now = wanted
        result.successful = True
        result.reason = ''
        return response


# %% safety-goals
class NavigationClient(Node):
    def __init__(self):
        super().__init__('navigation_poller')
        self.client = ActionClient(self, Drive, '/navigate')
        self.out = self.create_publisher(String, '/navigate/outcome', LOOSE)
        self.stop = self.create_publisher(Twist, '/cmd_vel', LOOSE)
        self.create_subscription(Int32, '/navigate/request', self.ask, 5)
        self.state = 'idle'
        self.create_timer(0.1, self.look)

    def ask(self, message):
        self.sent = self.client.send_goal_async(Drive.Goal(order=message.data), self.alive)
        self.state, self.since = 'sent', seconds(self)

    def alive(self, feedback):
        if self.state == 'driving':
            self.since = seconds(self)

    def say(self, word):
        if word != 'arrived':
            self.stop.publish(Twist())
        self.out.publish(String(data=word))
        self.state = 'idle'

    def look(self):
        silent = seconds(self) - getattr(self, 'since', 0.0) + 1e-6
        if self.state == 'sent':
            if self.sent.done():
                self.goal = self.sent.result()
                if self.goal.accepted:
                    self.result = self.goal.get_result_async()
                    self.state, self.since = 'driving', seconds(self)
                else:
                    self.say('rejected')
            elif silent >= 1.0:
                self.say('lost')
        elif self.state == 'driving':
            if self.result.done():
                good = self.result.result().status == GoalStatus.STATUS_SUCCEEDED
                self.say('arrived' if good else 'aborted')
            elif silent >= 2.0:
                self.cancel = self.goal.cancel_goal_async()
                self.state, self.since = 'canceling', seconds(self)
        elif self.state == 'canceling':
            if self.cancel.done():
                self.say('stalled' if self.cancel.result().goals_canceling else 'runaway')
            elif silent >= 1.0:
                self.say('lost')


# %% safety-drive
class NavigationServer(Node):
    def __init__(self):
        super().__init__('drive_poller')
        self.wheels = Wheels(self)
        self.fault = self.create_publisher(String, '/drive/fault', LOOSE)
        self.down = False
        ActionServer(
            self, Drive, '/drive', self.execute, goal_callback=self.check,
            cancel_callback=lambda handle: CancelResponse.ACCEPT,
        )

    def check(self, goal):
        return GoalResponse.ACCEPT if goal.order in range(1, 11) else GoalResponse.REJECT

    def execute(self, handle):
        # Blocks one of the four threads; the clock goes on in the others.
        begun, sequence = seconds(self), []
        while len(sequence) < handle.request.order:
            if handle.is_cancel_requested:
                self.wheels.stop()
                handle.canceled()
                return Drive.Result(sequence=sequence)
            try:
                if self.down:
                    raise WheelError('going down')
                self.wheels.drive()
            except WheelError as problem:
                self.wheels.stop()
                self.fault.publish(String(data=f'sorry: {problem}'))
                handle.abort()
                return Drive.Result(sequence=sequence)
            self.get_clock().sleep_for(Duration(seconds=0.1), context=self.context)
            if seconds(self) - begun >= len(sequence) + 1 - 1e-6:
                sequence.append(len(sequence) + 1)
                handle.publish_feedback(Drive.Feedback(sequence=sequence))
        self.wheels.stop()
        handle.succeed()
        return Drive.Result(sequence=sequence)

    def shutdown(self):
        self.down = True
        self.wheels.stop()


from rclpy.duration import Duration
