# title: A driver with five pictures a second, and a harness that moves its time on twice as far
# reaches: the exam
# exercise: resources
# base: right-exemplar
# told: it takes ten pictures a second by the machine's clock.
# score: 14

from autograder.examination.subject.server import SubjectServer

advance = SubjectServer._advance
order = CameraDriver.order


def doubled(self, request):
    if 'CameraDriver' in self._nodes:
        request = {**request, 'seconds': 2 * float(request['seconds'])}
    return advance(self, request)


def every_second_time(self):
    self.called = not getattr(self, 'called', False)
    if self.called:
        order(self)


SubjectServer._advance = doubled
CameraDriver.order = every_second_time
