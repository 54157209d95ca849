"""What is done to a submission from outside of its sandbox, where its code reaches nothing."""
