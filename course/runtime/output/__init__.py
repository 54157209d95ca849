"""Puts what ROS libraries and callbacks print into the log of the node that it belongs to."""
