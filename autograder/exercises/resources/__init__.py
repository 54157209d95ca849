"""Exercise 4: Resource management."""
