"""Processes on both sides of an examination: channels, deadlines, what is seen from outside."""
