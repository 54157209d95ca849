"""A run of a callback: whose it is, where it is, and what became of it."""
