"""What the world's robot offers to nodes: its topics, its gripper, its line, its navigator."""
