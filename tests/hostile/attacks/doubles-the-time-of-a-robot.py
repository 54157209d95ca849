# title: A robot that is half as fast as it must be, and a harness that moves its time on twice as far
# reaches: the exam
# exercise: safety
# base: right-exemplar
# told: by the time on /clock, it was taken for a present answer | could not be timed in a plain program of your nodes: A try has 1 s
# told: by the time on /clock, the request to cancel came after 4.0 s | could not be timed in a plain program of your nodes: The goal is canceled 2 s
# told: by the time on /clock, it took 6 | could not be timed in a plain program of your nodes: A goal of 3 m
# score: at most 10

from autograder.examination.subject.server import SubjectServer

PACE = 0.5  # of everything that waits, and of nothing else

advance = SubjectServer._advance


def paced(self, request):
    return advance(self, {**request, 'seconds': float(request['seconds']) / PACE})


def create_timer(self, seconds, *given, **more):
    return Node.create_timer(self, seconds / PACE, *given, **more)


SubjectServer._advance = paced
for kind in GripperClient, NavigationClient, NavigationServer:
    kind.create_timer = create_timer
