"""What learners answer: the form of an answer, and the attempts that are kept in files."""
