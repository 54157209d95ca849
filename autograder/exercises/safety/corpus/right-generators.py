# title: State machines: a generator a grip, an object a drive, and one event with a name for each
# fails: nothing

import threading
from functools import partial


class GripperClient(Node):
    """A generator says what it waits for next: for how long, and for an answer or not."""

    def __init__(self):
        super().__init__('gripper_client')
        everything = ReentrantCallbackGroup()
        self.client = self.create_client(SetBool, 'gripper/set', callback_group=everything)
        self.word = self.create_publisher(String, 'grip/outcome', 1)
        self.hold = self.create_publisher(Empty, 'arm/hold', 1)
        self.beat = self.create_publisher(Empty, 'grip/heartbeat', 1)
        self.create_timer(0.5, lambda: self.beat.publish(Empty()), callback_group=everything)
        self.create_subscription(Bool, 'grip/request', self.begin, 1, callback_group=everything)
        self.lock = threading.RLock()
        self.waiting = None

    def begin(self, message):
        self.proceed(self.story(message.data), None)

    def story(self, close):
        for pause in (0.6, 1.3, None):
            future = self.client.call_async(SetBool.Request(data=close))
            answer = yield 1.0, future
            if answer is not None:
                return 'done' if answer.success else 'refused'
            self.client.remove_pending_request(future)
            if pause is not None:
                yield pause, None
        return 'failed'

    def proceed(self, story, value):
        with self.lock:
            try:
                seconds, future = story.send(value)
            except StopIteration as end:
                self.waiting = None
                if end.value != 'done':
                    self.hold.publish(Empty())
                self.word.publish(String(data=end.value))
                return
            token = self.waiting = object()
            timer = once(self, seconds, partial(self.happened, token, story, None))
            if future is not None:
                future.add_done_callback(partial(self.answered, token, story, timer))

    def answered(self, token, story, timer, future):
        timer.cancel()
        self.happened(token, story, future.result())

    def happened(self, token, story, value):
        with self.lock:
            if self.waiting is token:
                self.waiting = None
                self.proceed(story, value)


# %% safety-speed
def in_range(highest, value):
    return value.type == ParameterType.PARAMETER_DOUBLE and 0.0 <= value.double_value <= highest


class SpeedServer(Node):
    RULES = {'linear': partial(in_range, 1.0), 'angular': partial(in_range, 2.0)}

    def __init__(self):
        super().__init__('speed_server')
        self.wheels, self.now = Wheels(self), (('linear', 0.5), ('angular', 1.0))
        group = ReentrantCallbackGroup()
        self.create_service(
            SetParametersAtomically, 'speed/set', self.serve, callback_group=group
        )

    async def serve(self, request, response):
        wrong = [
            p.name for p in request.parameters
            if p.name not in self.RULES or not self.RULES[p.name](p.value)
        ]
        result = response.result
        if wrong or not request.parameters:
            result.successful, result.reason = False, f'not good: {", ".join(wrong) or "empty"}'
            return response
        wanted = {**dict(self.now), **{p.name: p.value.double_value for p in request.parameters}}
        try:
            self.wheels.set_limits(wanted['linear'], wanted['angular'])
        except Exception as error:
            result.successful, result.reason = False, repr(error)
        else:
            self.now, result.successful = tuple(wanted.items()), True
        return response


# %% safety-goals
class Trip:
    """One drive: whichever comes first ends it, and nothing after that is heard."""

    def __init__(self, node, metres):
        self.node, self.handle, self.clock, self.over = node, None, None, False
        self.lock = threading.RLock()
        self.wait(1.0, 'lost')
        future = node.client.send_goal_async(Drive.Goal(order=metres), self.alive)
        future.add_done_callback(self.answered)

    def wait(self, seconds, word):
        with self.lock:
            if self.clock is not None:
                self.clock.cancel()
            if not self.over:
                self.clock = once(self.node, seconds, partial(self.end, word))

    def watch(self):
        with self.lock:
            if self.clock is not None:
                self.clock.cancel()
            if not self.over:
                self.clock = once(self.node, 2.0, self.silent)

    def end(self, word):
        with self.lock:
            if self.over:
                return
            self.over = True
            self.clock.cancel()
        if word != 'arrived':
            self.node.speed.publish(Twist())
        self.node.word.publish(String(data=word))

    def answered(self, future):
        handle = future.result()
        if not handle.accepted:
            self.end('rejected')
            return
        self.handle, self.canceling = handle, False
        self.watch()
        handle.get_result_async().add_done_callback(self.ended)

    def alive(self, _feedback):
        if self.handle is not None and not self.canceling:
            self.watch()

    def silent(self):
        self.canceling = True
        self.wait(1.0, 'lost')
        self.handle.cancel_goal_async().add_done_callback(self.stopped)

    def stopped(self, future):
        self.end('stalled' if future.result().goals_canceling else 'runaway')

    def ended(self, future):
        if not self.canceling:
            good = future.result().status == GoalStatus.STATUS_SUCCEEDED
            self.end('arrived' if good else 'aborted')


class NavigationClient(Node):
    def __init__(self):
        super().__init__('navigation_client')
        group = ReentrantCallbackGroup()
        self.client = ActionClient(self, Drive, 'navigate', callback_group=group)
        self.word = self.create_publisher(String, 'navigate/outcome', 5)
        self.speed = self.create_publisher(Twist, 'cmd_vel', 5)
        self.create_subscription(
            Int32, 'navigate/request', lambda m: Trip(self, m.data), 5, callback_group=group
        )


# %% safety-drive
class NavigationServer(Node):
    """Nothing runs between two ticks of a timer; the goal is executed once its end is known."""

    def __init__(self):
        super().__init__('navigation_server')
        self.wheels = Wheels(self)
        self.fault = self.create_publisher(String, 'drive/fault', 1)
        self.goal = self.how = None
        self.closing = False
        self.create_timer(0.1, self.tick, callback_group=ReentrantCallbackGroup())
        self.server = ActionServer(
            self,
            Drive,
            'drive',
            execute_callback=self.finish,
            goal_callback=lambda g: (
                GoalResponse.ACCEPT if g.order in range(1, 11) else GoalResponse.REJECT
            ),
            handle_accepted_callback=self.begin,
            cancel_callback=lambda _: CancelResponse.ACCEPT,
            callback_group=ReentrantCallbackGroup(),
        )

    def begin(self, goal):
        self.ticks, self.marks = 0, []
        self.goal = goal

    def tick(self):
        goal = self.goal
        if goal is None:
            return
        if goal.is_cancel_requested:
            self.end('canceled')
        elif self.closing:
            self.end('abort')
        elif self.ticks == 10 * goal.request.order:
            self.end('succeed')
        else:
            try:
                self.wheels.drive()
            except WheelError as error:
                self.fault.publish(String(data=f'cannot drive: {error}'))
                self.end('abort')
                return
            self.ticks += 1
            if self.ticks % 10 == 0:
                self.marks.append(self.ticks // 10)
                goal.publish_feedback(Drive.Feedback(sequence=self.marks))

    def end(self, how):
        goal, self.goal, self.how = self.goal, None, how
        self.wheels.stop()
        goal.execute()

    def finish(self, goal):
        getattr(goal, self.how)()
        return Drive.Result(sequence=self.marks)

    def shutdown(self):
        self.closing = True
        self.wheels.stop()
