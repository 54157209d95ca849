"""nbgrader's gradebook, its folders and its release; marks of quizzes and of written answers."""
