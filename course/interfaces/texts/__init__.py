"""Texts of interfaces: read line by line, checked, and the names of types."""
