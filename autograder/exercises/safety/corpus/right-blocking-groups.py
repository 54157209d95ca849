# title: Callbacks that block on the node's clock, in groups of their own; more feedback than asked
# fails: nothing

from rclpy.callback_groups import MutuallyExclusiveCallbackGroup as Own
from rclpy.duration import Duration


def wait(node, future, seconds):
    clock = node.get_clock()
    end = clock.now() + Duration(seconds=seconds)
    while not future.done() and clock.now() < end:
        clock.sleep_for(Duration(seconds=0.05), context=node.context)
    return future.done()


class GripperClient(Node):
    def __init__(self):
        super().__init__('gripper_client')
        self.gripper = self.create_client(SetBool, 'gripper/set', callback_group=Own())
        self.outcome = self.create_publisher(String, 'grip/outcome', 10)
        self.hold = self.create_publisher(Empty, 'arm/hold', 10)
        self.heartbeat = self.create_publisher(Empty, 'grip/heartbeat', 10)
        self.create_timer(0.5, lambda: self.heartbeat.publish(Empty()), callback_group=Own())
        self.create_subscription(Bool, 'grip/request', self.grip, 10, callback_group=Own())

    def grip(self, request):
        word = 'failed'
        for pause in (0, 1, 2):
            if pause:
                self.get_clock().sleep_for(Duration(seconds=pause), context=self.context)
            call = self.gripper.call_async(SetBool.Request(data=request.data))
            if wait(self, call, 1.0):
                word = 'done' if call.result().success else 'refused'
                break
        if word != 'done':
            self.hold.publish(Empty())
        self.outcome.publish(String(data=word))


# %% safety-speed
class SpeedServer(Node):
    def __init__(self):
        super().__init__('speed_server')
        self.wheels = Wheels(self)
        self.limits = (0.5, 1.0)
        self.create_service(
            SetParametersAtomically, 'speed/set', self.on_request, callback_group=Own()
        )

    def on_request(self, request, response):
        try:
            self.apply(request.parameters)
            response.result.successful = True
        except Exception as error:
            self.get_logger().warning(f'refused: {error}')
            response.result.successful = False
            response.result.reason = str(error) or 'bad'
        return response

    def apply(self, parameters):
        given = {p.name: p.value for p in parameters}
        if len(given) < len(parameters):
            raise KeyError('a limit is named twice')
        if not given or set(given) - {'linear', 'angular'}:
            raise KeyError(f'what is {sorted(given)}?')
        if any(v.type != ParameterType.PARAMETER_DOUBLE for v in given.values()):
            raise TypeError('doubles, please')
        linear = given['linear'].double_value if 'linear' in given else self.limits[0]
        angular = given['angular'].double_value if 'angular' in given else self.limits[1]
        if math.isnan(linear) or math.isnan(angular):
            raise ValueError('not a number')
        if linear < 0 or angular < 0 or linear > 1 or angular > 2:
            raise ValueError('out of range')
        self.wheels.set_limits(linear, angular)
        self.limits = (linear, angular)


# %% safety-goals
class NavigationClient(Node):
    def __init__(self):
        super().__init__('navigation_client')
        self.navigator = ActionClient(self, Drive, 'navigate', callback_group=Own())
        self.outcome = self.create_publisher(String, 'navigate/outcome', 10)
        self.cmd_vel = self.create_publisher(Twist, 'cmd_vel', 10)
        self.create_subscription(Int32, 'navigate/request', self.go, 10, callback_group=Own())

    def go(self, request):
        word = self.drive(request.data)
        if word != 'arrived':
            self.cmd_vel.publish(Twist())
        self.outcome.publish(String(data=word))

    def drive(self, metres):
        self.news = True
        sent = self.navigator.send_goal_async(Drive.Goal(order=metres), self.feed)
        if not wait(self, sent, 1.0):
            return 'lost'
        handle = sent.result()
        if not handle.accepted:
            return 'rejected'
        result = handle.get_result_async()
        clock, patience = self.get_clock(), Duration(seconds=1.9)
        last = clock.now()
        while not wait(self, result, 0.1):
            if self.news:
                self.news, last = False, clock.now()
            elif clock.now() - last >= patience:
                cancel = handle.cancel_goal_async()
                if not wait(self, cancel, 1.0):
                    return 'lost'
                return 'stalled' if cancel.result().goals_canceling else 'runaway'
        if result.result().status == GoalStatus.STATUS_SUCCEEDED:
            return 'arrived'
        return 'aborted'

    def feed(self, _):
        self.news = True


# %% safety-drive
class NavigationServer(Node):
    def __init__(self):
        super().__init__('navigation_server')
        self.wheels = Wheels(self)
        self.faults = self.create_publisher(String, 'drive/fault', 10)
        self.up = True
        self.server = ActionServer(
            self, Drive, 'drive', self.execute, goal_callback=self.on_goal,
            cancel_callback=self.on_cancel, callback_group=Own(),
        )

    def on_goal(self, goal):
        return GoalResponse.ACCEPT if 1 <= goal.order <= 10 else GoalResponse.REJECT

    def on_cancel(self, handle):
        self.wheels.stop()
        return CancelResponse.ACCEPT

    def execute(self, handle):
        rate = self.create_rate(10)
        passed = []
        try:
            for metre in range(1, handle.request.order + 1):
                handle.publish_feedback(Drive.Feedback(sequence=passed))
                for _ in range(10):
                    if handle.is_cancel_requested:
                        handle.canceled()
                        return Drive.Result(sequence=passed)
                    if not self.up:
                        raise WheelError('shut down')
                    self.wheels.drive()
                    rate.sleep()
                passed.append(metre)
                handle.publish_feedback(Drive.Feedback(sequence=passed))
            handle.succeed()
        except Exception as error:
            self.faults.publish(String(data=f'{error}'))
            handle.abort()
        finally:
            self.wheels.stop()
            self.destroy_rate(rate)
        return Drive.Result(sequence=passed)

    def shutdown(self):
        self.up = False
        self.wheels.stop()
