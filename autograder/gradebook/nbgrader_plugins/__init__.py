"""What nbgrader loads of ours: steps of autograding and export, model answers, and speed."""
