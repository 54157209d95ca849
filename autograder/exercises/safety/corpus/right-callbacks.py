# title: Futures with callbacks and one-shot timers, no coroutine; goals by their accepted callback
# fails: nothing

class GripperClient(Node):
    PAUSES = [0.5, 1.2]

    def __init__(self):
        super().__init__('gripper_client')
        self.gripper = self.create_client(SetBool, 'gripper/set')
        self.outcome = self.create_publisher(String, 'grip/outcome', 10)
        self.hold = self.create_publisher(Empty, 'arm/hold', 10)
        self.heartbeat = self.create_publisher(Empty, 'grip/heartbeat', 10)
        self.create_timer(0.5, lambda: self.heartbeat.publish(Empty()))
        self.create_subscription(Bool, 'grip/request', self.on_request, 10)
        self.pending = None

    def on_request(self, request):
        self.command = request.data
        self.tries = 0
        self.try_it()

    def try_it(self):
        self.tries += 1
        self.pending = self.gripper.call_async(SetBool.Request(data=self.command))
        self.pending.add_done_callback(self.on_answer)
        self.timer = once(self, 1.0, self.on_timeout)

    def on_answer(self, future):
        if future is not self.pending:
            return
        self.pending = None
        self.timer.cancel()
        if future.result().success:
            self.outcome.publish(String(data='done'))
        else:
            self.give_up('refused')

    def on_timeout(self):
        if self.pending is None:
            return
        self.gripper.remove_pending_request(self.pending)
        self.pending = None
        if self.tries == 3:
            self.give_up('failed')
        else:
            once(self, self.PAUSES[self.tries - 1], self.try_it)

    def give_up(self, word):
        self.hold.publish(Empty())
        self.outcome.publish(String(data=word))


# %% safety-speed
class SpeedServer(Node):
    def __init__(self):
        super().__init__('speed_server')
        self.wheels = Wheels(self)
        self.linear, self.angular = 0.5, 1.0
        self.create_service(SetParametersAtomically, 'speed/set', self.on_request)

    def on_request(self, request, response):
        linear, angular = self.linear, self.angular
        problem = '' if request.parameters else 'nothing to set'
        for p in request.parameters:
            v = p.value.double_value
            if p.value.type != ParameterType.PARAMETER_DOUBLE or not math.isfinite(v) or v < 0:
                problem = p.name + ' is no number that makes sense'
            elif p.name == 'linear' and v <= 1.0:
                linear = v
            elif p.name == 'angular' and v <= 2.0:
                angular = v
            else:
                problem = p.name + ' is unknown or too large'
        if not problem:
            try:
                self.wheels.set_limits(linear, angular)
                self.linear, self.angular = linear, angular
            except Exception as e:
                problem = repr(e)
        response.result.successful = not problem
        response.result.reason = problem
        return response


# %% safety-goals
class NavigationClient(Node):
    def __init__(self):
        super().__init__('navigation_client')
        self.navigator = ActionClient(self, Drive, 'navigate')
        self.outcome = self.create_publisher(String, 'navigate/outcome', 10)
        self.cmd_vel = self.create_publisher(Twist, 'cmd_vel', 10)
        self.create_subscription(Int32, 'navigate/request', self.on_request, 10)
        self.run = 0
        self.timer = None

    def on_request(self, request):
        self.run += 1
        self.busy = True
        run = self.run
        self.after(1.0, lambda: self.finish(run, 'lost'))
        sent = self.navigator.send_goal_async(
            Drive.Goal(order=request.data), feedback_callback=lambda _: self.on_feedback(run)
        )
        sent.add_done_callback(lambda future: self.on_goal(run, future))

    def after(self, seconds, callback):
        if self.timer is not None:
            self.timer.cancel()
        self.timer = once(self, seconds, callback)

    def on_goal(self, run, future):
        if run != self.run or not self.busy:
            return
        self.drive_handle = future.result()
        if not self.drive_handle.accepted:
            self.finish(run, 'rejected')
            return
        self.canceling = False
        self.after(2.0, lambda: self.on_silence(run))
        self.drive_handle.get_result_async().add_done_callback(lambda f: self.on_result(run, f))

    def on_feedback(self, run):
        if run == self.run and self.busy and not self.canceling:
            self.after(2.0, lambda: self.on_silence(run))

    def on_silence(self, run):
        self.canceling = True
        self.cmd_vel.publish(Twist())
        self.after(1.0, lambda: self.finish(run, 'lost'))
        self.drive_handle.cancel_goal_async().add_done_callback(
            lambda f: self.finish(run, 'stalled' if f.result().goals_canceling else 'runaway')
        )

    def on_result(self, run, future):
        if not self.canceling:
            good = future.result().status == GoalStatus.STATUS_SUCCEEDED
            self.finish(run, 'arrived' if good else 'aborted')

    def finish(self, run, word):
        if run != self.run or not self.busy:
            return
        self.busy = False
        self.timer.cancel()
        if word != 'arrived':
            self.cmd_vel.publish(Twist())
        self.outcome.publish(String(data=word))


# %% safety-drive
class NavigationServer(Node):
    def __init__(self):
        super().__init__('navigation_server')
        self.wheels = Wheels(self)
        self.fault = self.create_publisher(String, 'drive/fault', 10)
        self.goal = None
        self.closing = False
        self.server = ActionServer(
            self, Drive, 'drive',
            execute_callback=self.end,
            goal_callback=lambda g: GoalResponse.ACCEPT if 0 < g.order < 11 else GoalResponse.REJECT,
            cancel_callback=lambda _: CancelResponse.ACCEPT,
            handle_accepted_callback=self.begin,
        )
        self.create_timer(0.1, self.tick)

    def begin(self, goal_handle):
        self.marks, self.ticks, self.how = [], 0, None
        self.goal = goal_handle

    def tick(self):
        if self.goal is None:
            return
        try:
            if self.goal.is_cancel_requested:
                self.finish('canceled')
            elif self.closing:
                self.fault.publish(String(data='shutting down'))
                self.finish('abort')
            elif self.ticks == 10 * self.goal.request.order:
                self.finish('succeed')
            else:
                self.wheels.drive(1.0)
                self.ticks += 1
                if self.ticks % 10 == 0:
                    self.marks.append(self.ticks // 10)
                    self.goal.publish_feedback(Drive.Feedback(sequence=self.marks))
        except WheelError as error:
            self.fault.publish(String(data=str(error)))
            self.finish('abort')

    def finish(self, how):
        self.wheels.stop()
        goal, self.goal, self.how = self.goal, None, how
        goal.execute()

    def end(self, goal_handle):
        getattr(goal_handle, self.how)()
        return Drive.Result(sequence=self.marks)

    def shutdown(self):
        self.closing = True
        self.wheels.stop()
