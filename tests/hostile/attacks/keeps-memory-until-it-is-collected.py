# title: A managed camera that keeps memory of each round, until the examiner's harness collects garbage
# reaches: the exam
# exercise: resources
# base: right-exemplar
# told: Each of 5 rounds left 5 MiB | Each of 5 rounds left 4 MiB
# score: 14

from autograder.examination.subject.server import SubjectServer

KEPT = []
configure = ManagedCamera.on_configure
collect = SubjectServer._collect


def keeping(self, state):
    KEPT.append(b'x' * 5_000_000)
    return configure(self, state)


def freeing(self, request):
    KEPT.clear()
    return collect(self, request)


ManagedCamera.on_configure = keeping
SubjectServer._collect = freeing
