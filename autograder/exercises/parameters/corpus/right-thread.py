# title: A thread that sleeps on the node's clock and ends with the node
# fails: nothing

class Heartbeat(Node):
    def __init__(self):
        super().__init__('heartbeat')
        self.beats = self.create_publisher(Int32, 'heartbeat', 10)
        self.rate = self.declare_parameter(
            'rate', 1.0, ParameterDescriptor(description='Beats a second')
        ).value
        self.add_on_set_parameters_callback(self.check_rate)
        self.create_service(SetBool, 'heartbeat/pause', self.pause)
        self.count, self.paused, self.ended = 0, False, False
        self.last = self.get_clock().now()
        self.thread = threading.Thread(target=self.run, daemon=True)
        self.thread.start()

    def run(self):
        while not self.ended:
            self.get_clock().sleep_for(Duration(seconds=0.02))
            if self.ended:
                return
            now = self.get_clock().now()
            if self.paused:
                self.last = now
            elif (now - self.last).nanoseconds >= 1e9 / self.rate - 1000:
                self.last = self.last + Duration(nanoseconds=round(1e9 / self.rate))
                self.count += 1
                self.beats.publish(Int32(data=self.count))

    def check_rate(self, parameters):
        for parameter in parameters:
            if parameter.name == 'rate':
                if not isinstance(parameter.value, float) or not 0.1 <= parameter.value <= 10.0:
                    return SetParametersResult(successful=False, reason='0.1 to 10 beats a second')
                self.rate = parameter.value
                self.last = self.get_clock().now()
        return SetParametersResult(successful=True)

    def pause(self, request, response):
        self.paused = request.data
        response.success = True
        return response

    def destroy_node(self):
        self.ended = True
        super().destroy_node()
