# title: A camera with five pictures a second, and a harness that moves its time on twice as far
# reaches: the exam
# exercise: patterns
# base: right-exemplar
# told: They came at 5
# score: 13

from autograder.examination.subject.server import SubjectServer

advance = SubjectServer._advance
publish = RobotInterface.publish_picture


def doubled(self, request):
    return advance(self, {**request, "seconds": 2 * float(request["seconds"])})


def every_second_time(self):
    self.called = not getattr(self, "called", False)
    if self.called:
        publish(self)


SubjectServer._advance = doubled
RobotInterface.publish_picture = every_second_time
