# title: A managed camera whose name is none that a node can have
# reaches: the exam
# exercise: resources
# base: right-exemplar
# told: A node cannot be called '/a b'
# score: 9

ManagedCamera.get_fully_qualified_name = lambda self: "/a b"
