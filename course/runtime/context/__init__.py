"""The rclpy context of a session, from its start to its end."""
