"""Exercise 2: Node architecture."""
