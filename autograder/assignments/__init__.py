"""From the text of an assignment to its notebooks, and what its cells ask."""
