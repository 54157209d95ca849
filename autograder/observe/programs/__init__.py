"""The student's nodes in a plain program of rclpy, which nobody asks: only its clock is moved."""
