"""Code that shows on live nodes what a question was about, put where a learner can run it."""

from __future__ import annotations

from quizzes.errors import QuizError
from quizzes.marking.marks import Mark


def of_mark(mark: Mark) -> str:
    """Return the Python that shows what an answer was about; empty if there is none."""
    shows = [remark.show for remark in mark.remarks if remark.show and not remark.right]
    if shows:
        return shows[0]
    return mark.item.variant.code or "" if mark.item.variant.kind == "predict" else ""


def into_cell(mark: Mark) -> None:
    """Put it into a new cell below the one that runs.

    Raises:
        QuizError: there is nothing to show, or this is no notebook.
    """
    source = of_mark(mark)
    if not source:
        raise QuizError(f"Question {mark.item.number} has nothing to run.")
    from IPython.core.getipython import get_ipython

    shell = get_ipython()
    if shell is None:
        raise QuizError("There is no notebook here to put a cell into.")
    shell.set_next_input(source, replace=False)
