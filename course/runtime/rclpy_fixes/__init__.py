"""Defects of rclpy that sessions work around, a file each: what is wrong, and since when."""
