# title: A node with nothing in it
# fails: guard_starts
# says: guard_starts: There is no publisher on /safety/beat
# points: 0

class Guard(Node):
    def __init__(self):
        super().__init__('guard')
