"""What was handed in: found, claimed, asked about, and taken."""
