"""The process that a submission runs in: its cells, its nodes, and what it says of itself."""
