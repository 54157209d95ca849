"""``autograder claim``: a person says which file is what."""

from __future__ import annotations

from pathlib import Path

from autograder.assignments import quiz_cells, submission
from autograder.assignments.intake import claim_records, roster
from autograder.assignments.intake.claim_records import Claim, ClaimError
from autograder.assignments.intake.handed_files.archives import ArchiveError
from autograder.assignments.intake.handed_files.file_names import (
    join_names,
    printable_name,
    quote_name,
)
from autograder.assignments.intake.handed_files.handed_in import (
    HandedIn,
    HandedInItem,
    look_through,
)
from autograder.assignments.submission import MAX_NOTEBOOK_BYTES
from autograder.gradebook.nbgrader_plugins import autograde_steps
from quizzes.attempts import record


def keep_claim(
    root: Path,
    assignment: str,
    student: str,
    name: str,
    file: str,
    *,
    nothing: bool = False,
    withdraw: bool = False,
) -> str:
    """Keep what a person says of a notebook, or of a quiz's attempts; return what was done.

    Raises:
        ClaimError: there is no such thing; the message says what there is.
        NotReadyError: the assignment's source is damaged.
        SubmissionError: what is claimed cannot be read as a notebook.
    """
    from autograder.gradebook.course_gradebook import CourseGradebook

    names = _claimable_files(root, assignment)
    if name not in names:
        raise ClaimError(
            f"{join_names([name])} is no notebook of {join_names([assignment])}: there are "
            f"{join_names(names)}."
        )
    folder = roster.student_folder(root, student) / assignment
    if not folder.is_dir():
        raise ClaimError(
            f"There is nothing in {root / 'submitted'} that {join_names([student])} has handed in "
            f"for {join_names([assignment])}: look at the student's name, or put the files there."
        )
    if bool(file) + nothing + withdraw != 1:
        raise ClaimError(
            "Name one file, or say --nothing or --withdraw: there is "
            f"{_list_handed_in(look_through(folder))}."
        )
    student = CourseGradebook(root).read_roster().student_id(student)
    made = None if withdraw else _make_claim(folder, name, names[name], file)
    claim_records.keep_claim(root, assignment, student, name, made)
    again = f"`autograder grade {quote_name(assignment)}` takes it into account"
    if withdraw:
        return f"What was said of {student}'s {name} is taken back: {again}."
    what = f"is '{printable_name(file)}'" if file else "was not handed in"
    return f"{student}'s {name} {what}: {again}."


def _claimable_files(root: Path, assignment: str) -> dict[str, str]:
    """Return {what can be claimed: the file that it should be} in an assignment."""
    source = root / "source" / assignment
    notebooks = sorted(source.glob("*.ipynb"))
    if not notebooks:
        known = sorted(path.name for path in (root / "source").glob("*") if path.is_dir())
        raise ClaimError(
            f"There is no assignment {join_names([assignment])} in {root}: there is "
            f"{join_names(known) or 'none yet'}."
        )
    found = {path.stem: path.name for path in notebooks}
    for path in notebooks:
        for quiz in quiz_cells.in_cells(autograde_steps.read_source(path)):
            found[f"{quiz_cells.PREFIX}{quiz}"] = record.attempts_filename(quiz)
    return found


def _make_claim(folder: Path, name: str, proper: str, file: str) -> Claim:
    handed_in = look_through(folder)
    item = handed_in.find_item(file) if file else None
    if file and item is None:
        raise ClaimError(
            f"There is no {join_names([file])} in {folder}: there is {_list_handed_in(handed_in)}."
        )
    if item is not None:
        _require_kind(item, name)
    place = item.place if item else ""
    return Claim(place, claim_records.digest_state(folder, handed_in, proper, place))


def _require_kind(item: HandedInItem, name: str) -> None:
    """Raise if a file cannot be what it is claimed to be."""
    try:
        content = item.read(MAX_NOTEBOOK_BYTES + 1)
    except (OSError, ArchiveError) as error:
        raise ClaimError(f"{join_names([item.place])} cannot be read ({error}).") from None
    if name.startswith(quiz_cells.PREFIX):
        if not record.parse_attempts(content)[0]:
            raise ClaimError(f"{join_names([item.place])} holds no attempt at a quiz.")
    else:
        submission.parse(
            submission.decode_text(content, printable_name(item.place)), printable_name(item.place)
        )


def _list_handed_in(handed_in: HandedIn) -> str:
    return join_names(item.place for item in handed_in.items) or "nothing"
