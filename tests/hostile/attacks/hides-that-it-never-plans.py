# title: A planner without a response, in a process whose harness has no errors to tell of
# reaches: the exam
# exercise: architecture
# base: wrong-planner-forgets-response
# told: /plan_path did not answer a request.
# score: 14

from autograder.examination.subject.server import SubjectServer

SubjectServer._errors = lambda *_: {"errors": [], "of_threads": []}
