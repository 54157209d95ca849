"""The robot: its base, its gripper, and what its sensors read."""
