"""``python -m autograder``: the same as the command ``autograder``."""

from __future__ import annotations

from course.command_line.launch import autograder

if __name__ == "__main__":
    autograder()
