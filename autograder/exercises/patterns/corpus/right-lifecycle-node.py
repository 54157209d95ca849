# title: A lifecycle node, from scratch; feedback from the odometry's callback
# fails: nothing

from rclpy.lifecycle import LifecycleNode
from rclpy.task import Future


class RobotInterface(LifecycleNode):
    def __init__(self):
        super().__init__("carrier", namespace="floor")
        self.x, self.goal, self.arrived, self.passed = 0.0, None, None, []
        self.group = ReentrantCallbackGroup()
        options = {"callback_group": self.group}
        self.create_subscription(Float64, "/hardware/position", self.on_x, 5, **options)
        self.create_subscription(Float64, "/hardware/charge", self.on_charge, 5, **options)
        self.motors = self.create_publisher(Float64, "/hardware/speed", 1)
        self.create_service(Trigger, "/robot/position", self.on_trigger, **options)
        self.camera = self.create_publisher(Image, "/robot/camera", 10)
        self.create_timer(0.1, self.on_timer, **options)
        self.battery = self.create_publisher(
            BatteryState,
            "/robot/battery",
            QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL),
        )
        self.declare_parameter("max_speed", 0.5)
        self.add_on_set_parameters_callback(self.on_parameters)
        self.server = ActionServer(
            self,
            Fibonacci,
            "/robot/navigate",
            execute_callback=self.on_execute,
            cancel_callback=self.on_call_off,
            **options,
        )

    def on_parameters(self, parameters):
        good = all(0.1 <= p.value <= 1.0 for p in parameters if p.name == "max_speed")
        return SetParametersResult(successful=good, reason="" if good else "0.1 to 1.0")

    def on_timer(self):
        stamp = self.get_clock().now().to_msg()
        picture = Image(height=2, width=3, step=3, encoding="mono8", data=bytes(6))
        picture.header.stamp = stamp
        self.camera.publish(picture)

    def on_charge(self, msg):
        self.battery.publish(BatteryState(percentage=msg.data))

    def on_trigger(self, request, response):
        return Trigger.Response(success=True, message=f"{self.x}")

    def on_x(self, msg):
        self.x = msg.data
        if self.goal is not None:
            self.report(self.goal)

    def report(self, goal):
        while self.station < min(int(self.x), goal.request.order):
            self.station += 1
            self.passed.append(self.station)
            goal.publish_feedback(Fibonacci.Feedback(sequence=self.passed))
        if self.station >= goal.request.order and not self.arrived.done():
            self.arrived.set_result("arrived")

    def on_call_off(self, goal):
        self.motors.publish(Float64(data=0.0))
        # The goal is not marked yet: it is when this has returned.
        self.waker = self.create_timer(0.05, self.look, callback_group=self.group)
        return CancelResponse.ACCEPT

    def look(self):
        self.waker.cancel()
        if not self.arrived.done():
            self.arrived.set_result("called off")

    async def on_execute(self, goal):
        self.arrived = Future(executor=self.executor)
        self.station, self.passed, self.goal = int(self.x), [], goal
        self.motors.publish(Float64(data=self.get_parameter("max_speed").value))
        self.report(goal)
        how = await self.arrived
        self.goal = None
        self.motors.publish(Float64(data=0.0))
        goal.succeed() if how == "arrived" else goal.canceled()
        return Fibonacci.Result(sequence=self.passed)


# %% patterns-answers
choices = {
    "position": "service",
    "camera": "topic",
    "navigation": "action",
    "parameters": "service",
    "battery": "topic",
}
