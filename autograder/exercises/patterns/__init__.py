"""Exercise 3: Communication pattern selection."""
