"""What was handed in elsewhere comes into ``submitted/``: from an exchange, or a zip file."""
