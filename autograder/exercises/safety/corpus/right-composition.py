# title: Functions that make plain nodes; the work is in objects beside them
# fails: nothing

class Asker:
    def __init__(self, node):
        self.node = node
        group = ReentrantCallbackGroup()
        self.client = node.create_client(SetBool, 'gripper/set', callback_group=group)
        self.pub = node.create_publisher(String, 'grip/outcome', 1)
        self.safe = node.create_publisher(Empty, 'arm/hold', 1)
        node.create_subscription(Bool, 'grip/request', self.handle, 1, callback_group=group)

    async def within(self, future, seconds):
        gate = Future(executor=self.node.executor)
        timer = once(self.node, seconds, lambda: gate.done() or gate.set_result(False))
        future.add_done_callback(lambda _: gate.done() or gate.set_result(True))
        in_time = await gate
        timer.cancel()
        return in_time

    async def handle(self, message):
        pauses = iter([0.5, 1.1])
        outcome = None
        while outcome is None:
            call = self.client.call_async(SetBool.Request(data=message.data))
            if await self.within(call, 1.0):
                outcome = 'done' if call.result().success else 'refused'
            else:
                try:
                    await sleep(self.node, next(pauses))
                except StopIteration:
                    outcome = 'failed'
        if outcome in ('refused', 'failed'):
            self.safe.publish(Empty())
        self.pub.publish(String(data=outcome))


def GripperClient():
    node = Node('gripper_client', namespace='')
    node.asker = Asker(node)
    heart = node.create_publisher(Empty, 'grip/heartbeat', 1)
    node.create_timer(0.5, lambda: heart.publish(Empty()), callback_group=ReentrantCallbackGroup())
    return node


# %% safety-speed
def SpeedServer():
    node = Node('speed_server')
    wheels = Wheels(node)
    limits = dict(linear=0.5, angular=1.0)
    ranges = dict(linear=(0.0, 1.0), angular=(0.0, 2.0))

    def problems(parameters):
        if not parameters:
            yield 'there is nothing in it'
        for p in parameters:
            low, high = ranges.get(p.name, (1, 0))
            if p.value.type != ParameterType.PARAMETER_DOUBLE:
                yield f'{p.name} is not a double'
            elif not low <= p.value.double_value <= high:
                yield f'{p.name} cannot be {p.value.double_value}'

    async def serve(request, response):
        found = '; '.join(problems(request.parameters))
        if not found:
            wanted = limits | {p.name: p.value.double_value for p in request.parameters}
            try:
                wheels.set_limits(wanted['linear'], wanted['angular'])
            except WheelError as error:
                found = f'hardware: {error}'
            else:
                limits.update(wanted)
        response.result.successful, response.result.reason = not found, found
        return response

    node.create_service(SetParametersAtomically, 'speed/set', serve)
    return node


# %% safety-goals
class Driver:
    def __init__(self, node):
        self.node = node
        group = ReentrantCallbackGroup()
        self.client = ActionClient(node, Drive, 'navigate', callback_group=group)
        self.pub = node.create_publisher(String, 'navigate/outcome', 1)
        self.vel = node.create_publisher(Twist, 'cmd_vel', 1)
        node.create_subscription(Int32, 'navigate/request', self.handle, 1, callback_group=group)

    async def first(self, future, seconds):
        self.gate = Future(executor=self.node.executor)
        gate = self.gate
        timer = once(self.node, seconds, lambda: gate.done() or gate.set_result(False))
        future.add_done_callback(lambda _: gate.done() or gate.set_result(True))
        yes = await gate
        timer.cancel()
        return yes

    def fed(self, _):
        self.feedbacks += 1

    async def handle(self, message):
        outcome = await self.drive(message.data)
        self.pub.publish(String(data=outcome))
        if outcome != 'arrived':
            self.vel.publish(Twist())

    async def drive(self, metres):
        self.feedbacks = 0
        sent = self.client.send_goal_async(Drive.Goal(order=metres), self.fed)
        if not await self.first(sent, 1.0):
            return 'lost'
        handle = sent.result()
        if not handle.accepted:
            return 'rejected'
        result = handle.get_result_async()
        still = 0
        seen = 0
        while not await self.first(result, 0.1):
            still = still + 1 if seen == self.feedbacks else 0
            seen = self.feedbacks
            if still >= 20:
                canceled = handle.cancel_goal_async()
                if not await self.first(canceled, 1.0):
                    return 'lost'
                return 'stalled' if len(canceled.result().goals_canceling) else 'runaway'
        return {4: 'arrived'}.get(result.result().status, 'aborted')


def NavigationClient():
    node = Node('navigation_client')
    node.driver = Driver(node)
    return node


# %% safety-drive
def NavigationServer():
    node = Node('navigation_server')
    wheels = Wheels(node)
    fault = node.create_publisher(String, 'drive/fault', 1)
    state = {'down': False}

    async def execute(goal):
        passed = []
        how = goal.succeed
        for tick in range(1, 4 * goal.request.order + 1):
            try:
                if state['down']:
                    raise RuntimeError('the node goes down')
                wheels.drive(1.0)
            except (WheelError, RuntimeError):
                fault.publish(String(data='could not drive on'))
                how = goal.abort
                break
            await sleep(node, 0.25)
            if goal.is_cancel_requested:
                how = goal.canceled
                break
            if tick % 4 == 0:
                passed.append(tick // 4)
                goal.publish_feedback(Drive.Feedback(sequence=passed))
        wheels.stop()
        how()
        return Drive.Result(sequence=passed)

    def shutdown():
        state['down'] = True
        wheels.stop()

    node.shutdown = shutdown
    node.server = ActionServer(
        node, Drive, 'drive', execute, callback_group=ReentrantCallbackGroup(),
        goal_callback=lambda goal: GoalResponse(1 if goal.order <= 0 or goal.order > 10 else 2),
        cancel_callback=lambda goal: CancelResponse.ACCEPT,
    )
    return node
