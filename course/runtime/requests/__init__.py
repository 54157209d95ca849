"""What a session asks of the graph: messages, calls, goals."""
