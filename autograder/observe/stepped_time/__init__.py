"""Streams and goals of a node whose time goes on in small steps."""
