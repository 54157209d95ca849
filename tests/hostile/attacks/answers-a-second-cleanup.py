# title: A second cleanup that raises, and a harness that answers without calling it
# reaches: the exam
# exercise: resources
# base: second-cleanup-raises
# told: After the second call the program was gone.
# score: 14

from autograder.examination.subject.server import SubjectServer

call = SubjectServer._call
cleaned = set()


def once(self, request):
    node = self._nodes[request['node']]
    if id(node) in cleaned:
        return {'value': None}
    cleaned.add(id(node))
    return call(self, request)


SubjectServer._call = once
