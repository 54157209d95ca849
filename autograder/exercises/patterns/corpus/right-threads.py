# title: A node from scratch as one writes it in C++: a mutex, a camera thread while rclpy.ok(), a thread a goal
# fails: nothing
import rclpy
from rcl_interfaces.msg import ParameterType
from rclpy.task import Future


class RobotInterface(Node):

    kPicturePeriod = Duration(seconds=0.1)
    kControlPeriod = Duration(seconds=0.05)
    kClockJump = Duration(seconds=1.0)

    def __init__(self):
        super().__init__('robot_interface')

        self.mutex_ = threading.Lock()
        self.position_ = 0.0
        self.charge_ = 1.0
        self.max_speed_ = 0.5
        self.goals_ = 0

        self.subscriptions_group_ = MutuallyExclusiveCallbackGroup()
        self.services_group_ = MutuallyExclusiveCallbackGroup()
        self.action_group_ = MutuallyExclusiveCallbackGroup()

        self.speed_pub_ = self.create_publisher(Float64, 'hardware/speed', 10)
        self.camera_pub_ = self.create_publisher(Image, 'robot/camera', 5)
        qos = QoSProfile(depth=1)
        qos.reliability = ReliabilityPolicy.RELIABLE
        qos.durability = DurabilityPolicy.TRANSIENT_LOCAL
        self.battery_pub_ = self.create_publisher(BatteryState, 'robot/battery', qos)

        self.position_sub_ = self.create_subscription(
            Float64, 'hardware/position', self.on_position, 1,
            callback_group=self.subscriptions_group_)
        self.charge_sub_ = self.create_subscription(
            Float64, 'hardware/charge', self.on_charge, 10,
            callback_group=self.subscriptions_group_)

        self.position_srv_ = self.create_service(
            Trigger, 'robot/position', self.on_position_request,
            callback_group=self.services_group_)
        self.max_speed_srv_ = self.create_service(
            SetParameters, 'robot/max_speed', self.on_max_speed_request,
            callback_group=self.services_group_)

        self.navigate_server_ = ActionServer(
            self, Fibonacci, 'robot/navigate',
            execute_callback=self.handle_execute,
            goal_callback=self.handle_goal,
            cancel_callback=self.handle_cancel,
            handle_accepted_callback=self.handle_accepted,
            callback_group=self.action_group_)

        self.publish_charge()
        self.stop_ = threading.Event()
        self.camera_thread_ = threading.Thread(target=self.camera_loop, daemon=True)
        self.camera_thread_.start()

    def destroy_node(self):
        self.stop_.set()
        super().destroy_node()

    # hardware

    def on_position(self, msg):
        with self.mutex_:
            self.position_ = msg.data

    def on_charge(self, msg):
        with self.mutex_:
            self.charge_ = msg.data
        self.publish_charge()

    def get_position(self):
        with self.mutex_:
            return self.position_

    def publish_charge(self):
        msg = BatteryState()
        with self.mutex_:
            msg.percentage = self.charge_
        msg.present = True
        self.battery_pub_.publish(msg)

    def set_speed(self, speed):
        msg = Float64()
        msg.data = speed
        self.speed_pub_.publish(msg)

    # camera

    def camera_loop(self):
        clock = self.get_clock()
        due = clock.now()
        while rclpy.ok() and not self.stop_.is_set():
            try:
                due = due + self.kPicturePeriod
                clock.sleep_until(due)
                now = clock.now()
                if now - due > self.kClockJump or due - now > self.kClockJump:
                    due = now  # the clock has jumped, as when simulated time begins
                self.camera_pub_.publish(self.make_picture(now))
            except Exception:
                if rclpy.ok() and not self.stop_.is_set():
                    raise
                return

    def make_picture(self, now):
        msg = Image()
        msg.header.stamp = now.to_msg()
        msg.header.frame_id = 'camera'
        msg.height = 16
        msg.width = 16
        msg.step = 16
        msg.encoding = 'mono8'
        msg.data = bytes(16 * 16)
        return msg

    # services

    def on_position_request(self, _request, response):
        response.success = True
        response.message = '{:.4f}'.format(self.get_position())
        return response

    def on_max_speed_request(self, request, response):
        for parameter in request.parameters:
            result = SetParametersResult()
            result.successful = False
            value = parameter.value.double_value
            if parameter.name != 'max_speed':
                result.reason = 'there is only max_speed'
            elif parameter.value.type != ParameterType.PARAMETER_DOUBLE:
                result.reason = 'max_speed is a double'
            elif value >= 0.1 and value <= 1.0:
                with self.mutex_:
                    self.max_speed_ = value
                result.successful = True
            else:
                result.reason = 'max_speed has to be in [0.1, 1.0]'
            response.results.append(result)
        return response

    # action

    def handle_goal(self, goal):
        if self.goals_ > 0 or goal.order <= self.get_position():
            return GoalResponse.REJECT
        return GoalResponse.ACCEPT

    def handle_cancel(self, _goal_handle):
        return CancelResponse.ACCEPT

    def handle_accepted(self, goal_handle):
        with self.mutex_:
            self.goals_ += 1
        goal_handle.execute()

    async def handle_execute(self, goal_handle):
        # std::thread{execute, goal_handle}.detach(), but the result must be returned from here
        promise = Future()
        threading.Thread(target=self.run, args=(goal_handle, promise), daemon=True).start()
        return await promise

    def run(self, goal_handle, promise):
        result = Fibonacci.Result()
        try:
            self.execute(goal_handle, result)
        finally:
            with self.mutex_:
                self.goals_ -= 1
            promise.set_result(result)
            self.executor.wake()

    def execute(self, goal_handle, result):
        feedback = Fibonacci.Feedback()
        stations = []
        with self.mutex_:
            speed = self.max_speed_
            next_station = int(self.position_) + 1
        self.set_speed(speed)
        while next_station <= goal_handle.request.order:
            if goal_handle.is_cancel_requested:
                self.set_speed(0.0)
                result.sequence = stations
                goal_handle.canceled()
                return
            if self.get_position() >= next_station:
                stations.append(next_station)
                next_station += 1
                feedback.sequence = stations
                goal_handle.publish_feedback(feedback)
            else:
                self.get_clock().sleep_for(self.kControlPeriod)
        self.set_speed(0.0)
        result.sequence = stations
        goal_handle.succeed()


# %% patterns-answers
choices = {
    'position': 'service',
    'camera': 'topic',
    'navigation': 'action',
    'parameters': 'service',
    'battery': 'topic',
}
