# title: A thread that naps by the wall clock, and beats when the node's clock says so
# fails: nothing

import time


class Heartbeat(Node):
    def __init__(self):
        super().__init__('heartbeat')
        self.beats = self.create_publisher(Int32, 'heartbeat', 10)
        self.declare_parameter('rate', 1.0, ParameterDescriptor(description='Beats a second'))
        self.add_on_set_parameters_callback(self.check_rate)
        self.create_service(SetBool, 'heartbeat/pause', self.pause)
        self.count, self.paused, self.ended = 0, False, threading.Event()
        self.due = self.now() + 1.0
        threading.Thread(target=self.run, daemon=True).start()

    def now(self):
        return self.get_clock().now().nanoseconds / 1e9

    def run(self):
        while not self.ended.is_set():
            time.sleep(0.005)
            period = 1.0 / self.get_parameter('rate').value
            if self.paused:
                self.due = self.now() + period
            elif self.now() >= self.due - 1e-6:
                self.due += period
                self.count += 1
                self.beats.publish(Int32(data=self.count))

    def check_rate(self, parameters):
        for parameter in parameters:
            if parameter.name == 'rate':
                if not isinstance(parameter.value, float) or not 0.1 <= parameter.value <= 10.0:
                    return SetParametersResult(successful=False, reason='0.1 to 10 beats a second')
                self.due = self.now() + 1.0 / parameter.value
        return SetParametersResult(successful=True)

    def pause(self, request, response):
        self.paused = request.data
        response.success = True
        return response

    def destroy_node(self):
        self.ended.set()
        super().destroy_node()
