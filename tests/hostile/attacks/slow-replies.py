# title: Answers to the examiner that each come just in time
# exercise: resources
# base: right-no-thread
# told: Your program took 150 s in all for what it was asked to do
# score: any

import time

from autograder.examination.subject.server import SubjectServer

answer = SubjectServer._answer


def late(self, request):
    time.sleep(9)
    return answer(self, request)


SubjectServer._answer = late
