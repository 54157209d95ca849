"""Recognises the cells and the answers of a submitted notebook."""
