"""The endpoints of a node at work: what it publishes, asks, and is asked to carry out."""
