"""What driving takes, without ROS: to see what is in the way, to find a way, and to steer."""
