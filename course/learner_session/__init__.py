"""Sessions as learners use them: one of their own, or the one that every notebook has."""
