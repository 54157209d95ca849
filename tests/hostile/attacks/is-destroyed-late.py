# title: A callback that waits for ever if the driver ends meanwhile, and a harness that ends it when no callback waits
# reaches: the exam
# exercise: resources
# base: callback-waits-for-worker
# told: was not seen while one of its callbacks waited for the camera
# score: 14

from autograder.examination.subject.server import SubjectServer

call = SubjectServer._call


def late(self, request):
    if request['method'] == 'destroy_node':
        threading.Event().wait(2.0)
    return call(self, request)


SubjectServer._call = late
