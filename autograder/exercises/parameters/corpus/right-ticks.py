# title: One fast timer that looks at the clock, and beats when a beat is due
# fails: nothing

class Heartbeat(Node):
    def __init__(self):
        super().__init__('heartbeat')
        self.beats = self.create_publisher(Int32, 'heartbeat', 10)
        self.declare_parameter('rate', 1.0, ParameterDescriptor(description='Beats a second'))
        self.add_on_set_parameters_callback(self.check_rate)
        self.create_service(SetBool, 'heartbeat/pause', self.pause)
        self.count, self.paused = 0, False
        self.last = self.now()
        self.create_timer(0.01, self.tick)

    def now(self):
        return self.get_clock().now().nanoseconds / 1e9

    def tick(self):
        if self.paused:
            self.last = self.now()
        elif self.now() - self.last >= 1.0 / self.get_parameter('rate').value - 1e-6:
            self.last = self.now()
            self.count += 1
            self.beats.publish(Int32(data=self.count))

    def check_rate(self, parameters):
        good = all(p.name != 'rate' or (isinstance(p.value, float) and 0.1 <= p.value <= 10.0)
                   for p in parameters)
        return SetParametersResult(successful=good, reason='' if good else 'from 0.1 to 10, please')

    def pause(self, request, response):
        self.paused = request.data
        response.success = True
        return response
