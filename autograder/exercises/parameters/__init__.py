"""Chapter 6, exercise 1: parameters and timers."""
