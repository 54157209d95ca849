"""Pages of feedback: a student's, and the index of what there is."""
