"""What the error-handling exam puts each of the student's nodes through."""
