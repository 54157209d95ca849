"""Executors that spin in the background: waiting, running callbacks, standing still."""
