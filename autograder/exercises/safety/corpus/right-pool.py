# title: A thread pool; one-shot timers set events; a heart in a thread that sleeps until it is due
# fails: nothing

import threading
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

from rclpy.duration import Duration


@dataclass(frozen=True)
class Policy:
    tries: int = 3
    patience: float = 1.0
    first_pause: float = 0.5
    growth: float = 0.75

    def pauses(self):
        yield from (self.first_pause + n * self.growth for n in range(self.tries - 1))
        yield None


class Either:
    """Blocks a thread until a future is done or a time of the node's clock has passed."""

    def __init__(self, node, future, seconds):
        self.event = threading.Event()
        self.node, self.future = node, future
        self.timer = once(node, seconds, self.event.set)
        if future is not None:
            future.add_done_callback(lambda _: self.event.set())

    def wait(self):
        self.event.wait()
        self.timer.cancel()
        return None if self.future is None or not self.future.done() else self.future.result()


class GripperClient(Node):
    POLICY = Policy()

    def __init__(self):
        super().__init__('gripper_client')
        self.pool = ThreadPoolExecutor(2)
        self.gripper = self.create_client(SetBool, 'gripper/set')
        self.outcome = self.create_publisher(String, 'grip/outcome', 10)
        self.hold = self.create_publisher(Empty, 'arm/hold', 10)
        self.heartbeat = self.create_publisher(Empty, 'grip/heartbeat', 10)
        self.create_subscription(Bool, 'grip/request', self.on_request, 10)
        threading.Thread(target=self.beat, daemon=True).start()

    def beat(self):
        clock, period = self.get_clock(), Duration(seconds=0.5)
        due = clock.now()
        while self.context.ok():
            due += period
            if not clock.sleep_until(due, context=self.context):
                due = clock.now()
                continue
            try:
                self.heartbeat.publish(Empty())
            except Exception:
                return

    def on_request(self, request):
        self.pool.submit(self.serve, request.data)

    def serve(self, close):
        answer = self.ask(close)
        word = 'failed' if answer is None else ('done' if answer.success else 'refused')
        if word != 'done':
            self.hold.publish(Empty())
        self.outcome.publish(String(data=word))

    def ask(self, close):
        for pause in self.POLICY.pauses():
            call = self.gripper.call_async(SetBool.Request(data=close))
            answer = Either(self, call, self.POLICY.patience).wait()
            if answer is not None:
                return answer
            self.gripper.remove_pending_request(call)
            if pause is not None:
                Either(self, None, pause).wait()
        return None


# %% safety-speed
from contextlib import contextmanager


@contextmanager
def answering(response):
    """Make an answer of whatever comes out of the block."""
    result = response.result
    result.successful, result.reason = False, 'unknown'
    try:
        yield
    except Exception as error:
        result.reason = f'{type(error).__name__}: {error}'
    else:
        result.successful, result.reason = True, ''


class SpeedServer(Node):
    def __init__(self):
        super().__init__('speed_server')
        self.wheels = Wheels(self)
        self.lock = threading.Lock()
        self.linear, self.angular = 0.5, 1.0
        self.create_service(
            SetParametersAtomically, 'speed/set', self.on_request,
            callback_group=ReentrantCallbackGroup(),
        )

    def on_request(self, request, response):
        with self.lock, answering(response):
            wanted = dict(linear=self.linear, angular=self.angular)
            if len(request.parameters) < 1:
                raise LookupError('no parameter')
            for p in request.parameters:
                wanted[p.name]  # an unknown name is a KeyError
                if p.value.type is not None and p.value.type != ParameterType.PARAMETER_DOUBLE:
                    raise TypeError(f'{p.name} is of type {p.value.type}')
                v = p.value.double_value
                if not math.isfinite(v) or math.copysign(1.0, v) < 0 and v != 0:
                    raise ValueError(f'{p.name} = {v}')
                if v > (1.0 if p.name == 'linear' else 2.0):
                    raise OverflowError(f'{p.name} = {v} is too fast')
                wanted[p.name] = v
            self.wheels.set_limits(**wanted)
            self.linear, self.angular = wanted['linear'], wanted['angular']
        return response


# %% safety-goals
class NavigationClient(Node):
    """Blocks one of the four threads for a drive; the events come from the other ones."""

    def __init__(self):
        super().__init__('navigation_client')
        self.group = ReentrantCallbackGroup()
        self.navigator = ActionClient(self, Drive, 'navigate', callback_group=self.group)
        self.outcome = self.create_publisher(String, 'navigate/outcome', 10)
        self.cmd_vel = self.create_publisher(Twist, 'cmd_vel', 10)
        self.create_subscription(
            Int32, 'navigate/request', self.on_request, 10, callback_group=self.group
        )

    def on_request(self, request):
        word = 'lost'
        try:
            word = self.drive(request.data)
        finally:
            if word != 'arrived':
                self.cmd_vel.publish(Twist())
            self.outcome.publish(String(data=word))

    def drive(self, metres):
        signs = threading.Semaphore(0)
        alive = []

        def feed(_):
            alive.append(True)
            signs.release()

        sent = self.navigator.send_goal_async(Drive.Goal(order=metres), feedback_callback=feed)
        handle = Either(self, sent, 1.0).wait()
        if handle is None:
            return 'lost'
        if not handle.accepted:
            return 'rejected'
        alive.clear()
        result = handle.get_result_async()
        result.add_done_callback(lambda _: signs.release())
        while True:
            watchdog = once(self, 2.0, signs.release)
            signs.acquire()
            watchdog.cancel()
            if result.done():
                good = result.result().status == GoalStatus.STATUS_SUCCEEDED
                return 'arrived' if good else 'aborted'
            if not alive:
                break
            alive.clear()
        answer = Either(self, handle.cancel_goal_async(), 1.0).wait()
        if answer is None:
            return 'lost'
        return 'stalled' if answer.goals_canceling else 'runaway'


# %% safety-drive
class NavigationServer(Node):
    """A control loop of 20 Hz commands the wheels for ever, also to stand; goals set its target."""

    def __init__(self):
        super().__init__('navigation_server')
        self.group = ReentrantCallbackGroup()
        self.wheels = Wheels(self)
        self.fault = self.create_publisher(String, 'drive/fault', 10)
        self.lock = threading.RLock()
        self.going, self.trouble, self.closing = False, None, False
        self.create_timer(0.05, self.control, callback_group=self.group)
        self.server = ActionServer(
            self, Drive, 'drive', self.execute, callback_group=self.group,
            goal_callback=lambda g: GoalResponse.ACCEPT if 1 <= g.order <= 10 else GoalResponse.REJECT,
            cancel_callback=self.on_cancel,
        )

    def control(self):
        with self.lock:
            if not self.going:
                self.wheels.stop()
                return
            try:
                self.wheels.drive()
            except WheelError as error:
                self.trouble, self.going = str(error), False
                self.wheels.stop()

    def on_cancel(self, _):
        with self.lock:
            self.going = False
            self.wheels.stop()
        return CancelResponse.ACCEPT

    async def execute(self, goal):
        begun = self.get_clock().now()
        marks = []
        with self.lock:
            self.trouble = 'shutting down' if self.closing else None
            self.going = not self.closing
        while True:
            if goal.is_cancel_requested:
                how = goal.canceled
                break
            if self.trouble:
                self.fault.publish(String(data=self.trouble))
                how = goal.abort
                break
            metres = (self.get_clock().now() - begun).nanoseconds / 1e9
            if metres >= len(marks) + 1:
                marks.append(len(marks) + 1)
                goal.publish_feedback(Drive.Feedback(sequence=marks))
            if len(marks) == goal.request.order:
                how = goal.succeed
                break
            await sleep(self, 0.1)
        with self.lock:
            self.going = False
            self.wheels.stop()
        how()
        return Drive.Result(sequence=marks)

    def shutdown(self):
        with self.lock:
            self.closing, self.going, self.trouble = True, False, 'shutting down'
            self.wheels.stop()
