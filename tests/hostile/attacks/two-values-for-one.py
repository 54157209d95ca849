# title: Whoever asks for one parameter is told two
# reaches: the exam
# exercise: patterns
# base: right-exemplar
# score: 13
# told: No node has a parameter max_speed

from rcl_interfaces.srv import GetParameters
from rclpy.parameter_service import ParameterService

_answer = ParameterService._get_parameters_callback


def twice(self, request, response):
    response = _answer(self, request, response)
    response.values = [*response.values] * 2
    return response


ParameterService._get_parameters_callback = twice
