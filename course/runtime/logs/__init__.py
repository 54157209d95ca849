"""What a session logs, and the table of it that learners read."""
