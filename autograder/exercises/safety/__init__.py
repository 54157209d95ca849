"""Exercise 5: Error handling."""
