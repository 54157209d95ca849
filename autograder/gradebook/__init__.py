"""nbgrader's gradebook, its folders and its release."""
