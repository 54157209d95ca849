"""Which file of a submission is which notebook, if names do not say it.

A notebook lies under its own name in the submission's folder. Where it does not, while something
lies there that nobody has claimed, there is a question: the one file that holds the notebook's
cells is taken, and that is said; anything else is left to a person, never graded as nothing.
Claimed are the assignment's notebooks, a quiz's attempts, and what was handed out.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path, PurePosixPath

from nbformat import NotebookNode

from autograder.assignments import submission
from autograder.assignments.intake import attempts_search, claim_records, roster
from autograder.assignments.intake.claim_records import Claim
from autograder.assignments.intake.handed_files.archives import ArchiveError
from autograder.assignments.intake.handed_files.attachments import (
    MAX_BYTES,
    Attachments,
    files_beside,
)
from autograder.assignments.intake.handed_files.file_names import (
    find_entry,
    join_names,
    normalise_name,
    printable_name,
    quote_name,
)
from autograder.assignments.intake.handed_files.handed_in import (
    NOTEBOOK,
    HandedIn,
    HandedInItem,
    handed_out,
    look_through,
)
from autograder.assignments.intake.recognition import cell_matching
from autograder.assignments.submission import MAX_NOTEBOOK_BYTES, SubmissionError
from quizzes.attempts.record import read_plain

ALIKE = 0.5
"""Part of a notebook's given cells that a file must have to be taken for it."""

GRADED_AS = "graded as"
"""Stands in what a student is told of a notebook that lay somewhere else."""

ARCHIVES = (".zip", ".tar", ".gz", ".tgz", ".bz2", ".xz", ".7z", ".rar")
"""Ends of names of what may hold a notebook, and is not looked into, or only in part."""

MAX_READ = 20
"""Files of other names that are read as notebooks; further ones are left to a person."""


class UnclearError(SubmissionError):
    """A notebook that may be among what was handed in: a person has to say.

    Attributes:
        suggestion: for that person, what to do.
    """

    def __init__(self, why: str, suggestion: str) -> None:
        """``why`` is for the student, too."""
        super().__init__(why)
        self.suggestion = suggestion


class NotHandedInError(SubmissionError):
    """A notebook that a person has said was not handed in."""


@dataclass(frozen=True)
class Found:
    """A student's notebook.

    Attributes:
        notebook: as it was handed in.
        item: where it was found, if not in its own place.
        notes: for the student.
        remarks: for a person.
        claimed: a person has said that this is it, so nothing more is asked about it.
    """

    notebook: NotebookNode
    item: HandedInItem | None = None
    notes: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()
    claimed: bool = False


def of_student(
    root: Path, assignment: str, student: str, released: Mapping[str, NotebookNode]
) -> Intake:
    """Return the intake of what a student has handed in to the course at ``root``.

    ``released`` is as for `Intake`.
    """
    release = root / "release" / assignment
    return Intake(
        roster.student_folder(root, student) / assignment,
        released,
        claim_records.of_student(root, assignment, student),
        whose=f"{quote_name(assignment)} {quote_name(student)}",
        given=handed_out(release),
        around=lambda: roster.unclaimed_names(roster.student_folder(root, student), (assignment,)),
    )


@dataclass(frozen=True)
class _Candidate:
    item: HandedInItem
    notebook: NotebookNode | None = field(repr=False)
    of: str = ""

    @property
    def cell_texts(self) -> list[tuple[str, str]]:
        assert self.notebook is not None
        return [(cell.cell_type, cell.source) for cell in self.notebook.cells]


class Intake:
    """Looks through one student's submission of one assignment."""

    def __init__(
        self,
        folder: Path,
        released: Mapping[str, NotebookNode],
        claims: Mapping[str, Claim],
        *,
        whose: str,
        given: frozenset[str] = frozenset(),
        around: Callable[[], list[str]] = list,
    ) -> None:
        """Prepare; nothing is read before it is asked for.

        Args:
            folder: the submission.
            released: {name: notebook as it was handed out}.
            claims: what a person has said of it.
            whose: the assignment and the student, as the command line wants them.
            given: places of other files that were handed out.
            around: gives the names in the student's folder that belong to no assignment.
        """
        self._folder = folder
        self._released = released
        self._claims = claims
        self._whose = whose
        self._given = given
        self._around = around

    @cached_property
    def handed_in(self) -> HandedIn:
        """All that lies there."""
        return look_through(self._folder)

    def find_notebook(self, name: str) -> Found:
        """Return a student's notebook.

        Raises:
            UnclearError: a person has to say which it is.
            NotHandedInError: a person has said that there is none.
            SubmissionError: there is none, or it cannot be read.
        """
        remarks: tuple[str, ...] = ()
        if (claim := self._claims.get(name)) is not None:
            if (void := self._void_reason(name, claim)) is None:
                return self._find_claimed(name, claim)
            remarks = (void,)
        path = self.proper_path(name)
        if path.is_symlink() or path.exists():
            found = self._find_in_place(name, path)
        else:
            found = self._find_elsewhere(name, " ".join(remarks))
        return Found(found.notebook, found.item, found.notes, (*remarks, *found.remarks))

    def proper_path(self, name: str) -> Path:
        """Return where a notebook belongs."""
        return find_entry(self._folder, f"{name}.ipynb")

    def read_content(self, name: str) -> bytes:
        """Return what the file holds that counts as a notebook.

        Of one that is larger than any notebook, no more than that. It raises as `find_notebook`,
        or OSError.
        """
        found = self.find_notebook(name)
        if found.item is not None:
            return found.item.read(MAX_NOTEBOOK_BYTES + 1)
        return read_plain(self.proper_path(name), MAX_NOTEBOOK_BYTES + 1)

    def find_attachments(self, found: Found) -> Attachments:
        """Return the files that a notebook's code finds: also those of the folder it lay in."""
        every = files_beside(self._folder)
        if found.item is None:
            return every
        files, room = dict(every.files), MAX_BYTES
        for place, item in self.handed_in.items_beside(found.item):
            if item is found.item or place.endswith(".ipynb"):
                continue
            try:
                content = item.read(room + 1)
            except (OSError, ArchiveError):
                continue
            if len(content) <= room and _is_plain_path(place):
                files[normalise_name(place)] = content
                room -= len(content)
        return Attachments(files, every.notes)

    @property
    def has_others(self) -> bool:
        """Whether any notebook of the assignment is there."""
        there = any(self.proper_path(name).is_file() for name in self._released)
        return there or any(candidate.of for candidate in self._candidates)

    def _void_reason(self, name: str, claim: Claim) -> str | None:
        """Return why a claim no longer holds, or None if it does."""
        now = claim_records.digest_state(self._folder, self.handed_in, f"{name}.ipynb", claim.file)
        if now == claim.state:
            return None
        what = (
            f"'{printable_name(claim.file)}' was claimed" if claim.file else "nothing was claimed"
        )
        gone = claim.file and self.handed_in.find_item(claim.file) is None
        return (
            f"{what} as {name}.ipynb, but {'is gone' if gone else 'the submission has changed'} "
            "since: the claim no longer holds."
        )

    def _find_claimed(self, name: str, claim: Claim) -> Found:
        if not claim.file:
            raise NotHandedInError(f"{name}.ipynb was not handed in, as a person has said.")
        item = self.handed_in.find_item(claim.file)
        assert item is not None  # its state would be another
        notebook = _parse_item(item)
        if item.place == f"{name}.ipynb":
            return Found(notebook, claimed=True)
        said = f"'{printable_name(item.place)}' was {GRADED_AS} {name}.ipynb, as a person has said."
        return Found(notebook, item, (said,), claimed=True)

    def _find_in_place(self, name: str, path: Path) -> Found:
        """Return the notebook in its own place, unless another one is more likely meant."""
        others = [c for c in self._candidates if c.of == name and not self._is_stub(name, c)]
        try:
            notebook = submission.read_notebook(path)
        except SubmissionError as error:
            if others:
                raise self._unclear_error(
                    name, f"{error} But there is {_list_places(others)}, too:", others
                ) from None  # fmt: skip
            if like := self._like_work(name):
                raise self._unclear_error(name, f"{error} But there is {like}, too:") from None
            raise
        others = [c for c in others if c.cell_texts != _Candidate(c.item, notebook).cell_texts]
        if not others:
            untouched = cell_matching.is_untouched(notebook, self._released[name])
            if untouched and (like := self._like_work(name)):
                said = f"{name}.ipynb is as it was handed out, but there is {like}, too:"
                raise self._unclear_error(name, said)
            return Found(notebook)
        if cell_matching.is_untouched(notebook, self._released[name]):
            said = (
                f"{name}.ipynb is as it was handed out, but there is {_list_places(others)}, too:"
            )
            raise self._unclear_error(name, said, others)
        return Found(
            notebook, remarks=(f"{name}.ipynb was graded; there is {_list_places(others)}, too.",)
        )

    def _find_elsewhere(self, name: str, before: str) -> Found:
        """Return a notebook that is not in its own place."""
        found = self._distinct_candidates([c for c in self._candidates if c.of == name], name)
        if len(found) == 1:
            item, notebook = found[0].item, found[0].notebook
            assert notebook is not None
            said = (
                f"There was no {name}.ipynb, but '{printable_name(item.place)}' holds its cells, "
                f"so it was {GRADED_AS} that."
            )
            return Found(notebook, item, (said,), (said,))
        missing = f"There is no {name}.ipynb in the submission"
        if found:
            raise self._unclear_error(
                name, f"{missing}, but there are {_list_places(found)}:", found
            )
        if (other := self._find_misnamed(name)) is not None:
            said = f"{missing}, but {printable_name(other.item.place)} holds its cells:"
            raise self._unclear_error(name, said, [other])
        if strange := self._unexplained_items():
            names = join_names(item.place for item in strange)
            verb = "is" if len(strange) == 1 else "are"
            raise self._unclear_error(
                name, f"{missing}, but there {verb} {names}{self._closed_reasons(strange)}:"
            )
        if before:  # what a person had said was there is not
            raise self._unclear_error(name, f"{missing}; {before} So")
        if around := self._around():
            raise self._beside_the_folder(name, missing, around)
        raise SubmissionError(f"{missing}.")

    def _unclear_error(
        self, name: str, said: str, found: list[_Candidate] | None = None
    ) -> UnclearError:
        place = quote_name(found[0].item.place) if found else "FILE"
        command = f"autograder claim {self._whose} {quote_name(name)}"
        return UnclearError(
            f"{said} a person has to say what counts.",
            f"Say it with `{command} {place}`, or with `{command} --nothing` if it was not handed "
            "in; then grade again.",
        )

    def _beside_the_folder(self, name: str, missing: str, around: list[str]) -> UnclearError:
        verb, them = ("lies", "it") if len(around) == 1 else ("lie", "them")
        return UnclearError(
            f"{missing}, but next to the submission's folder {verb} {join_names(around)}: a "
            "person has to say what counts.",
            f"Move {them} into that folder if that is this assignment's work, and to another place "
            f"if not, or say with `autograder claim {self._whose} {quote_name(name)} --nothing` "
            "that it was not handed in; then grade again.",
        )

    def _distinct_candidates(self, found: list[_Candidate], name: str) -> list[_Candidate]:
        """Leave out copies, and stubs beside what was worked on."""
        worked_on = [c for c in found if not self._is_stub(name, c)]
        distinct: list[_Candidate] = []
        for candidate in worked_on or found[:1]:
            if all(candidate.cell_texts != other.cell_texts for other in distinct):
                distinct.append(candidate)
        return distinct

    def _is_stub(self, name: str, candidate: _Candidate) -> bool:
        assert candidate.notebook is not None
        return cell_matching.is_untouched(candidate.notebook, self._released[name])

    @cached_property
    def _candidates(self) -> list[_Candidate]:
        """Files of other names that are, or may be, notebooks."""
        own = {f"{name}.ipynb" for name in self._released}
        likely = [
            item for item in self.handed_in.items
            if _may_be_notebook(item.name) and normalise_name(item.place) not in own
        ]  # fmt: skip
        found = []
        for number, item in enumerate(likely):
            try:
                notebook = _parse_item(item) if number < MAX_READ else None
            except SubmissionError:
                notebook = None
            if notebook is not None or NOTEBOOK in item.name.lower():
                found.append(_Candidate(item, notebook, self._match_notebook(notebook)))
        return found

    def _match_notebook(self, notebook: NotebookNode | None) -> str:
        """Return which of the assignment's notebooks one is, by its given cells."""
        if notebook is None:
            return ""
        alike = {
            name: cell_matching.measure_likeness(notebook, released)
            for name, released in self._released.items()
        }
        best = max(alike, key=lambda name: alike[name])
        return best if alike[best] >= ALIKE else ""

    def _unexplained_items(self) -> list[HandedInItem]:
        """Return what may stand for a missing notebook: all that is known to be nothing else."""
        own = {f"{name}.ipynb" for name in self._released}
        taken = {candidate.item.place for candidate in self._candidates if candidate.of}
        taken |= {claim.file for claim in self._claims.values()}
        unclaimed = [
            item for item in self.handed_in.unclaimed_items(self._given)
            if normalise_name(item.place) not in own and item.place not in taken
        ]  # fmt: skip
        of_quizzes = {item.place for item, _ in attempts_search.with_attempts(unclaimed)}
        return [item for item in unclaimed if item.place not in of_quizzes]

    def _like_work(self, name: str) -> str:
        """Return what may hold the work on a notebook that is a stub or damaged, as a phrase.

        A picture or a module in the same folder does not count: other notebooks use those, too.
        """
        return join_names(
            item.place for item in self._unexplained_items()
            if _may_be_notebook(item.name) or item.name.lower().endswith(ARCHIVES)
            or normalise_name(item.name).lower().startswith(f"{name}.")
        )  # fmt: skip

    def _find_misnamed(self, name: str) -> _Candidate | None:
        """Return the notebook that lies in the place of another one, and holds this one's cells."""
        for other in self._released:
            item = self.handed_in.find_item(f"{other}.ipynb") if other != name else None
            if item is not None:
                with suppress(SubmissionError):
                    notebook = _parse_item(item)
                    if self._match_notebook(notebook) == name and not self._is_stub(
                        name, found := _Candidate(item, notebook, name)
                    ):
                        return found
        return None

    def _closed_reasons(self, strange: list[HandedInItem]) -> str:
        reasons = [self.handed_in.closed.get(item.place, "") for item in strange]
        return "".join(f" ({reason})" for reason in dict.fromkeys(reasons) if reason)


def _parse_item(item: HandedInItem) -> NotebookNode:
    """Return the notebook in a file; raises SubmissionError if there is none."""
    name = printable_name(item.place)
    try:
        content = item.read(MAX_NOTEBOOK_BYTES + 1)
    except (OSError, ArchiveError) as error:
        raise SubmissionError(f"{name} cannot be read ({error}).") from None
    if len(content) > MAX_NOTEBOOK_BYTES:
        raise SubmissionError(
            f"{name} has more than the {MAX_NOTEBOOK_BYTES // 2**20} MB that are read: clear its "
            "outputs and hand it in again."
        )
    return submission.parse(submission.decode_text(content, name), name)


def _may_be_notebook(name: str) -> bool:
    # "x.ipynb.txt", "x.ipynb (1)" and "x.ipynb.bak" are what browsers and editors make of one.
    return NOTEBOOK in name.lower() or name.lower().endswith(".json")


def _is_plain_path(place: str) -> bool:
    """Whether a zip file's name for a member can be that of a file below a folder."""
    path = PurePosixPath(place)
    plain = place == str(path) and not path.is_absolute() and "\0" not in place
    return plain and ".." not in path.parts and not path.name.startswith(".")


def _list_places(found: list[_Candidate]) -> str:
    return join_names(candidate.item.place for candidate in found)
