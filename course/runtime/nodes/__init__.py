"""The nodes of a session: made, known by name, destroyed."""
