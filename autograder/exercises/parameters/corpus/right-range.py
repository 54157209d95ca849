# title: rclpy itself refuses what is out of the descriptor's range
# fails: nothing

class Heartbeat(Node):
    def __init__(self):
        super().__init__('heartbeat')
        self.beats = self.create_publisher(Int32, 'heartbeat', 10)
        about = ParameterDescriptor(
            description='Beats a second',
            floating_point_range=[FloatingPointRange(from_value=0.1, to_value=10.0)],
        )
        self.declare_parameter('rate', 1.0, about)
        self.add_on_set_parameters_callback(self.refuse_what_is_no_number)
        self.add_post_set_parameters_callback(self.use_rate)
        self.create_service(SetBool, 'heartbeat/pause', self.pause)
        self.count = 0
        self.timer = self.create_timer(1.0, self.beat)

    def beat(self):
        self.count += 1
        self.beats.publish(Int32(data=self.count))

    def refuse_what_is_no_number(self, parameters):
        if any(p.name == 'rate' and math.isnan(p.value) for p in parameters):
            return SetParametersResult(successful=False, reason='that is not a number')
        return SetParametersResult(successful=True)

    def use_rate(self, parameters):
        paused = self.timer.is_canceled()
        self.timer.timer_period_ns = round(1e9 / self.get_parameter('rate').value)
        if not paused:
            self.timer.reset()

    def pause(self, request, response):
        if request.data:
            self.timer.cancel()
        else:
            self.timer.reset()
        response.success = True
        response.message = 'paused' if request.data else 'running'
        return response
