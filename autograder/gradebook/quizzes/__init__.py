"""Quizzes in the gradebook: marked with the course's banks."""
