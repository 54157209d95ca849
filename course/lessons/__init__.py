"""What the chapters' small tasks are checked with: one sentence at once, and never a traceback."""
