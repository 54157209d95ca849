"""Written answers, marked by a person."""
