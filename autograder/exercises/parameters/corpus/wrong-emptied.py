# title: A node with nothing in it
# fails: node_starts
# says: node_starts: There is no publisher on /heartbeat
# points: 0

class Heartbeat(Node):
    def __init__(self):
        super().__init__('heartbeat')
