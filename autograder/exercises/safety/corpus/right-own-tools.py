# title: Coroutines, with none of the given tools
# fails: nothing

class Waiter(Node):
    def __init__(self, name):
        super().__init__(name)
        self.free = ReentrantCallbackGroup()

    async def pause(self, seconds):
        await self.result_of(Future(executor=self.executor), seconds)

    async def result_of(self, future, seconds, keep=lambda: False):
        """Return (in time?, result); `keep()` says that the time begins anew."""
        def late():
            if not keep():
                timer.cancel()
                if not future.done():
                    future.cancel()

        timer = self.create_timer(seconds, late, callback_group=self.free)
        try:
            value = await future
        finally:
            timer.cancel()
        return value


class GripperClient(Waiter):
    def __init__(self):
        super().__init__('hand')
        self.srv = self.create_client(SetBool, 'gripper/set', callback_group=self.free)
        self.out = self.create_publisher(String, 'grip/outcome', 10)
        self.brake = self.create_publisher(Empty, 'arm/hold', 10)
        self.pulse = self.create_publisher(Empty, 'grip/heartbeat', 10)
        self.create_timer(0.5, self.tick, callback_group=self.free)
        self.create_subscription(Bool, 'grip/request', self.on, 10, callback_group=self.free)

    def tick(self):
        self.pulse.publish(Empty())

    async def on(self, msg, attempt=1):
        reply = await self.result_of(self.srv.call_async(SetBool.Request(data=msg.data)), 1.0)
        if reply is None and attempt < 3:
            await self.pause(0.7 * attempt)
            return await self.on(msg, attempt + 1)
        if reply is not None and reply.success:
            return self.out.publish(String(data='done'))
        self.brake.publish(Empty())
        self.out.publish(String(data='failed' if reply is None else 'refused'))


# %% safety-speed
class SpeedServer(Node):
    MOST = (('linear', 1.0), ('angular', 2.0))

    def __init__(self):
        super().__init__('speeds')
        self.hw = Wheels(self)
        self.values = {'linear': 0.5, 'angular': 1.0}
        self.create_service(SetParametersAtomically, 'speed/set', self.on)

    def on(self, req, res):
        bad = [p for p in req.parameters if not any(
            p.name == n and p.value.type == ParameterType.PARAMETER_DOUBLE
            and p.value.double_value >= 0.0 and p.value.double_value <= m for n, m in self.MOST)]
        if bad or not req.parameters:
            res.result.reason = f'{len(bad)} bad parameters'
            return res
        new = self.values.copy()
        new.update((p.name, p.value.double_value) for p in req.parameters)
        try:
            self.hw.set_limits(new['linear'], new['angular'])
        except WheelError:
            res.result.reason = 'jam'
        else:
            self.values = new
            res.result.successful = True
        return res


# %% safety-goals
class NavigationClient(Waiter):
    def __init__(self):
        super().__init__('pilot')
        self.action = ActionClient(self, Drive, 'navigate')
        self.out = self.create_publisher(String, 'navigate/outcome', 10)
        self.vel = self.create_publisher(Twist, 'cmd_vel', 10)
        self.create_subscription(Int32, 'navigate/request', self.on, 10, callback_group=self.free)

    async def on(self, msg):
        self.fresh = False
        goal = self.action.send_goal_async(Drive.Goal(order=msg.data), self.feed)
        gh = await self.result_of(goal, 1.0)
        if gh is None:
            return self.stop('lost')
        if not gh.accepted:
            return self.stop('rejected')
        self.left = 20
        res = await self.result_of(gh.get_result_async(), 0.1, self.counting)
        if res is not None:
            if res.status == GoalStatus.STATUS_SUCCEEDED:
                return self.out.publish(String(data='arrived'))
            return self.stop('aborted')
        self.vel.publish(Twist())
        ans = await self.result_of(gh.cancel_goal_async(), 1.0)
        if ans is None:
            return self.stop('lost')
        self.stop('stalled' if ans.goals_canceling else 'runaway')

    def counting(self):
        self.left -= 1
        return self.left > 0

    def feed(self, _):
        self.left = 20

    def stop(self, word):
        self.vel.publish(Twist())
        self.out.publish(String(data=word))


# %% safety-drive
class NavigationServer(Waiter):
    def __init__(self):
        super().__init__('drive_train')
        self.wheels = Wheels(self)
        self.reason = self.create_publisher(String, 'drive/fault', 10)
        self.trouble = ''
        self.server = ActionServer(
            self, Drive, 'drive', self.run, goal_callback=self.may, cancel_callback=self.halt
        )

    def may(self, goal):
        return GoalResponse.REJECT if goal.order < 1 or goal.order > 10 else GoalResponse.ACCEPT

    def halt(self, gh):
        self.wheels.stop()
        return CancelResponse.ACCEPT

    async def run(self, gh):
        self.done = []
        for metre in range(gh.request.order):
            if not await self.metre(gh):
                break
            self.done.append(metre + 1)
            feedback = Drive.Feedback()
            feedback.sequence = list(self.done)
            gh.publish_feedback(feedback)
        self.wheels.stop()
        if gh.is_cancel_requested:
            gh.canceled()
        elif self.trouble:
            self.reason.publish(String(data=self.trouble))
            gh.abort()
            if self.trouble != 'shutdown':
                self.trouble = ''
        else:
            gh.succeed()
        result = Drive.Result()
        result.sequence = self.done
        return result

    async def metre(self, gh):
        for _ in range(8):
            if gh.is_cancel_requested or self.trouble:
                return False
            try:
                self.wheels.drive(1.0)
            except WheelError as jam:
                self.trouble = f'jam: {jam}'
            await self.pause(0.125)
        return not self.trouble

    def shutdown(self):
        self.trouble = 'shutdown'
        self.wheels.stop()
