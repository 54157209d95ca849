# title: A thread of its own for each job, which sleeps on the node's clock, and is slow to note which answer it expects
# fails: nothing

import threading

from rclpy.duration import Duration


class Patient(Node):
    """A node whose threads can wait for a future on the node's clock."""

    def nap(self, seconds):
        self.get_clock().sleep_for(Duration(seconds=seconds), context=self.context)

    def wait(self, future, seconds):
        end = self.get_clock().now() + Duration(seconds=seconds - 0.001)
        while not future.done() and self.get_clock().now() < end:
            self.nap(0.1)
        return future.done()

    def work(self, job, *args):
        threading.Thread(target=job, args=args, daemon=True).start()


class GripperClient(Patient):
    def __init__(self):
        super().__init__('gripper_client')
        self.gripper = self.create_client(SetBool, 'gripper/set')
        self.outcome = self.create_publisher(String, 'grip/outcome', 10)
        self.hold = self.create_publisher(Empty, 'arm/hold', 10)
        self.heartbeat = self.create_publisher(Empty, 'grip/heartbeat', 10)
        self.create_timer(0.5, lambda: self.heartbeat.publish(Empty()))
        self.create_subscription(Bool, 'grip/request', lambda m: self.work(self.grip, m.data), 10)

    def grip(self, close):
        word = self.tries(close)
        if word != 'done':
            self.hold.publish(Empty())
        self.outcome.publish(String(data=word))

    def tries(self, close):
        for number in range(3):
            answer = self.gripper.call_async(SetBool.Request(data=close))
            if self.wait(answer, 1.0):
                return 'done' if answer.result().success else 'refused'
            self.gripper.remove_pending_request(answer)
            if number < 2:
                self.nap([0.5, 1.5][number])
        return 'failed'


# %% safety-speed
class SpeedServer(Node):
    """With the node's own parameters as the limits."""

    def __init__(self):
        super().__init__('speed_server')
        self.declare_parameter('linear', 0.5)
        self.declare_parameter('angular', 1.0)
        self.wheels = Wheels(self)
        self.create_service(SetParametersAtomically, 'speed/set', self.on_request)

    def on_request(self, request, response):
        try:
            assert request.parameters, 'empty'
            limits = {n: self.get_parameter(n).value for n in ('linear', 'angular')}
            for parameter in request.parameters:
                assert parameter.name in limits, 'unknown name'
                assert parameter.value.type == ParameterType.PARAMETER_DOUBLE, 'no double'
                value = parameter.value.double_value
                assert 0.0 <= value <= {'linear': 1.0, 'angular': 2.0}[parameter.name], 'range'
                limits[parameter.name] = value
            self.wheels.set_limits(limits['linear'], limits['angular'])
            from rclpy.parameter import Parameter
            self.set_parameters([Parameter(n, value=v) for n, v in limits.items()])
            response.result.successful = True
        except Exception as error:
            response.result.successful = False
            response.result.reason = f'{type(error).__name__}: {error}'
        return response


# %% safety-goals
import time

from rclpy.action import client as rclpy_client
from rclpy.task import Future


def future_of_a_busy_machine():
    # Between rclpy's sending of a request and its noting it: a thread may well lose its turn there.
    end = time.monotonic() + 0.02
    while time.monotonic() < end:
        pass
    return Future()


rclpy_client.Future = future_of_a_busy_machine


class NavigationClient(Patient):
    def __init__(self):
        super().__init__('navigation_client')
        self.navigator = ActionClient(self, Drive, 'navigate')
        self.outcome = self.create_publisher(String, 'navigate/outcome', 10)
        self.cmd_vel = self.create_publisher(Twist, 'cmd_vel', 10)
        self.create_subscription(Int32, 'navigate/request', lambda m: self.work(self.go, m.data), 10)

    def go(self, metres):
        word = self.drive(metres)
        if word != 'arrived':
            self.cmd_vel.publish(Twist())
        self.outcome.publish(String(data=word))

    def drive(self, metres):
        sign = [self.get_clock().now()]

        def alive(_):
            sign[0] = self.get_clock().now()

        sent = self.navigator.send_goal_async(Drive.Goal(order=metres), alive)
        if not self.wait(sent, 1.0):
            return 'lost'
        handle = sent.result()
        if not handle.accepted:
            return 'rejected'
        alive(None)
        result = handle.get_result_async()
        while not result.done():
            if self.get_clock().now() - sign[0] > Duration(seconds=1.99):
                cancel = handle.cancel_goal_async()
                if not self.wait(cancel, 1.0):
                    return 'lost'
                return 'stalled' if cancel.result().goals_canceling else 'runaway'
            self.nap(0.1)
        good = result.result().status == GoalStatus.STATUS_SUCCEEDED
        return 'arrived' if good else 'aborted'


# %% safety-drive
class NavigationServer(Patient):
    def __init__(self):
        super().__init__('navigation_server')
        self.wheels = Wheels(self)
        self.fault = self.create_publisher(String, 'drive/fault', 10)
        self.closing = threading.Event()
        self.server = ActionServer(
            self, Drive, 'drive', lambda goal: goal.answer,
            goal_callback=lambda g: GoalResponse.ACCEPT if 1 <= g.order <= 10 else GoalResponse.REJECT,
            cancel_callback=lambda _: CancelResponse.ACCEPT,
            handle_accepted_callback=lambda goal: self.work(self.drive, goal),
        )

    def drive(self, goal):
        passed, end = [], goal.succeed
        try:
            while len(passed) < goal.request.order and end == goal.succeed:
                for _ in range(5):
                    if goal.is_cancel_requested:
                        end = goal.canceled
                        break
                    if self.closing.is_set():
                        raise WheelError('shut down')
                    self.wheels.drive()
                    self.nap(0.2)
                else:
                    passed.append(len(passed) + 1)
                    goal.publish_feedback(Drive.Feedback(sequence=passed))
        except WheelError as error:
            self.fault.publish(String(data=str(error)))
            end = goal.abort
        self.wheels.stop()

        def execute(_):
            end()
            return Drive.Result(sequence=passed)

        goal.execute(execute)

    def shutdown(self):
        self.closing.set()
        self.wheels.stop()
