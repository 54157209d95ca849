# title: Whoever sets one parameter of the managed camera is told two results
# reaches: the exam
# exercise: resources
# base: right-exemplar
# score: 9
# told: managed_camera/set_parameters gave 2

from rclpy.parameter_service import ParameterService

_answer = ParameterService._set_parameters_callback


def twice(self, request, response):
    response = _answer(self, request, response)
    response.results = [*response.results] * 2
    return response


ParameterService._set_parameters_callback = twice
