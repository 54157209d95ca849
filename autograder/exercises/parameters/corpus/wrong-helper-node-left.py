# title: A second node, which the first one makes and nobody destroys, has the publisher
# fails: ends_with_its_node
# says: ends_with_its_node: There still is a publisher on /heartbeat



class Heartbeat(Node):
    def __init__(self):
        super().__init__('heartbeat')
        self.heart = Node('heart', context=self.context, start_parameter_services=False)
        self.beats = self.heart.create_publisher(Int32, 'heartbeat', 10)
        self.declare_parameter('rate', 1.0, ParameterDescriptor(description='Beats a second'))
        self.add_on_set_parameters_callback(self.check_rate)
        self.add_post_set_parameters_callback(self.use_rate)
        self.create_service(SetBool, 'heartbeat/pause', self.pause)
        self.count = 0
        self.timer = self.create_timer(1.0, self.beat)

    def beat(self):
        self.count += 1
        self.beats.publish(Int32(data=self.count))

    def check_rate(self, parameters):
        good = all(p.name != 'rate' or (isinstance(p.value, float) and 0.1 <= p.value <= 10.0)
                   for p in parameters)
        return SetParametersResult(successful=good, reason='' if good else 'from 0.1 to 10')

    def use_rate(self, parameters):
        paused = self.timer.is_canceled()
        self.timer.timer_period_ns = round(1e9 / self.get_parameter('rate').value)
        if not paused:
            self.timer.reset()

    def pause(self, request, response):
        self.timer.cancel() if request.data else self.timer.reset()
        response.success = True
        return response
