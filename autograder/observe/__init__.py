"""What several exams look with: nodes, waits and the words of their findings."""
