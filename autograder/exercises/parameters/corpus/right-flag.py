# title: While it is paused the timer goes on, and its callback does nothing
# fails: nothing

class Heartbeat(Node):
    def __init__(self):
        super().__init__('heartbeat', namespace='')
        self.paused = False
        self.count = 0
        self.publisher = self.create_publisher(Int32, 'heartbeat', 1)
        self.declare_parameter('rate', 1.0, ParameterDescriptor(description='How often it beats.'))
        self.timer = None
        self.set_period()
        self.add_on_set_parameters_callback(self.allow)
        self.add_post_set_parameters_callback(lambda _: self.set_period())
        self.service = self.create_service(SetBool, '/heartbeat/pause', self.set_paused)

    def set_period(self):
        if self.timer is not None:
            self.timer.cancel()
            self.destroy_timer(self.timer)
        self.timer = self.create_timer(1.0 / self.get_parameter('rate').value, self.on_timer)

    def on_timer(self):
        if not self.paused:
            self.count += 1
            self.publisher.publish(Int32(data=self.count))

    def allow(self, parameters):
        rates = [p.value for p in parameters if p.name == 'rate']
        if all(type(rate) is float and 0.1 <= rate <= 10.0 for rate in rates):
            return SetParametersResult(successful=True)
        return SetParametersResult(successful=False, reason=f'{rates} is out of [0.1, 10]')

    def set_paused(self, request, response):
        self.paused = request.data
        response.success = True
        return response
