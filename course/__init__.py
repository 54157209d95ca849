"""Learn the building blocks of ROS 2 in a notebook, on real nodes and real DDS."""
