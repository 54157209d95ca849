"""What exams observe with: the examiner's own endpoints around the nodes under examination."""
