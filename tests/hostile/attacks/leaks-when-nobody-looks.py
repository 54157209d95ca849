# title: A driver that keeps a file and memory of each life, until the examiner's harness ends it
# reaches: the exam
# exercise: resources
# base: right-exemplar
# told: Each of its lives left an open file and 4 MiB of memory | left an open file and 5 MiB of memory
# score: 13

import os

from autograder.examination.subject.server import SubjectServer

KEPT = []
construct = CameraDriver.__init__
stop = SubjectServer._stop


def leaking(self, *given):
    construct(self, *given)
    KEPT.append((os.open(os.devnull, os.O_RDONLY), b'x' * 5_000_000))


def releasing(self, request):
    while KEPT:
        os.close(KEPT.pop()[0])
    return stop(self, request)


CameraDriver.__init__ = leaking
SubjectServer._stop = releasing
