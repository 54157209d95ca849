"""What libraries of ROS and callbacks print, taken to whom it concerns."""
