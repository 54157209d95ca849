"""Chapter 6, exercise 2: executors and callback groups."""
