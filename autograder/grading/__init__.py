"""A class is graded: its submissions taken in, run, entered."""
