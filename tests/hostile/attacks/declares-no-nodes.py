# title: A design that declares no node, and makes them all itself
# reaches: the exam
# exercise: architecture
# base: right-chapter
# told: `design` declares no nodes

_declared = design


class Design:
    def node_factories(self):
        _declared.run()
        return {}


design = Design()
