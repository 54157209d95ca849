# title: A cell that is not Python
# fails: the first

class Robot(Node:
    def __init__(self)
