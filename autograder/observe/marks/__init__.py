"""Marks that travel: marked goals and messages go in, and it is seen where they come out."""
