"""A design at work: its nodes drive a simulated robot, and what is missing shows on the floor.

What a node does follows from what it is declared to read and write (`meanings`). All that the
nodes know comes in messages of the declared types; only the robot's cables (sensors, motors) and
the floor plan, from which a map is drawn, come from the world. `departure` is the door.
"""
