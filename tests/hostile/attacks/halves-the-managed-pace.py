# title: A managed camera with half as many pictures, and a harness that moves its time on twice as far
# reaches: the exam
# exercise: resources
# base: right-exemplar
# told: as many pictures a second by the machine's clock as its rate says
# score: 14

from autograder.examination.subject.server import SubjectServer

advance = SubjectServer._advance
take_picture = ManagedCamera.take_picture


def doubled(self, request):
    if 'ManagedCamera' in self._nodes:
        request = {**request, 'seconds': 2 * float(request['seconds'])}
    return advance(self, request)


def every_second_time(self):
    self.called = not getattr(self, 'called', False)
    if self.called:
        take_picture(self)


SubjectServer._advance = doubled
ManagedCamera.take_picture = every_second_time
