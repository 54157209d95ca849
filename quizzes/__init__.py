"""The question bank and its marking. It imports nothing of the course or the autograder."""
