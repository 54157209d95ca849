"""Pictures of what a check has observed over time: their data, their drawing, and their words."""
