"""ROS messages as data: their types, their values, as text, and as a recording in a file."""
