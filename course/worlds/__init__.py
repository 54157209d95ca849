"""A simulated floor with one robot on it: the physics, and the ROS 2 node that carries them.

`Simulation` needs no ROS, and `RunningWorld` runs one as a node of a session. Frames and units are
those of REP 103 and REP 105: m, rad, s; x forward, y to the left, yaw counter-clockwise.
"""
