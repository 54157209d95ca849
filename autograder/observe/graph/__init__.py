"""The ROS graph as data: who is connected to whom, under which QoS, and why a link is not there."""
