"""The commands of each room."""
