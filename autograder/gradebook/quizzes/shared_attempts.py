"""Who of a class has handed in the same attempts at a quiz: for a person to look at, by name."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from autograder.assignments.intake import attempts_search, roster
from quizzes.attempts import sharing


def same_attempts(
    root: Path, assignment: str, quiz: str, students: Iterable[str]
) -> list[tuple[str, ...]]:
    """Return groups of students who have handed in the same attempts, whatever their files' names.

    Args:
        root: the course root.
        assignment: the one that has the quiz.
        quiz: its name.
        students: those who have handed in something.
    """
    contents = {}
    for student in students:
        folder = roster.student_folder(root, student) / assignment
        try:
            found = attempts_search.find_attempts(folder, quiz, student, root)
        except OSError:
            continue  # its grade says that it cannot be read
        if found.content is not None:
            contents[student] = found.content
    return sharing.same_attempts(quiz, contents)
