"""Exercise 1: QoS profile design."""
