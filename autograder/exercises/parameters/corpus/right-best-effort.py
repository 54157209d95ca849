# title: A node of another name, in two callback groups, whose beats are best effort
# fails: nothing

from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.qos import qos_profile_sensor_data


class Heartbeat(Node):
    def __init__(self):
        super().__init__('heart_of_the_robot')
        self.beats = self.create_publisher(Int32, 'heartbeat', qos_profile_sensor_data)
        self.group = MutuallyExclusiveCallbackGroup()
        self.rate = self.declare_parameter(
            'rate', 1.0, ParameterDescriptor(description='Beats a second')
        ).value
        self.numbers = iter(range(1, 1_000_000))
        self.timer = self.create_timer(1 / self.rate, self.beat, callback_group=self.group)
        self.add_on_set_parameters_callback(self.on_set)
        self.create_service(SetBool, 'heartbeat/pause', self.on_pause)
        self.paused = False

    def beat(self):
        self.beats.publish(Int32(data=next(self.numbers)))

    def on_set(self, parameters):
        for parameter in parameters:
            if parameter.name == 'rate':
                try:
                    wanted = float(parameter.value)
                    if not 0.1 <= wanted <= 10:
                        raise ValueError(f'{wanted} is not from 0.1 to 10')
                except ValueError as error:
                    return SetParametersResult(successful=False, reason=str(error))
                self.rate = wanted
                self.timer.cancel()
                self.timer = self.create_timer(1 / wanted, self.beat, callback_group=self.group)
                if self.paused:
                    self.timer.cancel()
        return SetParametersResult(successful=True)

    async def on_pause(self, request, response):
        self.paused = request.data
        self.timer.cancel() if request.data else self.timer.reset()
        response.success = True
        return response
