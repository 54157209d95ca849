"""Reading the corpus: files of whole solutions, and a table of splices.

In an exercise's folder, ``corpus/<name>.py`` is what a student wrote, under a header of comments:

    # title: one line that says what is special about it
    # fails: the checks that must fail, by name; "nothing" for a correct design, "the first" for
    #        every check that needs no other, "everything" for what cannot be examined at all,
    #        "as the stub" for what must come out as ``wrong-stub`` does
    # says: check: a fragment that its result must hold        (any number of them)
    # in: the stub                                             (the text replaces the stub's mark)
    # seconds: 5                                               (what one of its cells may take)
    # points: 0                                                (what all parts together must earn)

The text is that of the cell ``<exam>-solution``. A line ``# %% <grade id>`` begins that of another.

``corpus/mutants.toml`` has one table a mutant: ``title``, ``fails`` (a list), ``says`` (a table),
and ``splices``: a list of {cell, old, new}, applied to the exemplar's cells, so that mutants follow
the exemplar. ``cell`` is ``<exam>-solution`` if it is left out. Without splices it is the exemplar.
Its table ``equivalent`` says of mutations that ``autograder mutate`` makes why they change nothing.

``every/<name>.py`` beside this module are cases for every exam: their text replaces the solution
cell, and the other solution cells are emptied; with "in: the stub" it replaces the stub's mark.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

from autograder.corpus.case import EVERYTHING, ROOTS, Case, CorpusError, Splice, solution_cell
from autograder.running.runner import CELL_TIMEOUT_S
from autograder.util import exercise_folders

MUTANTS, EQUIVALENT = "mutants.toml", "equivalent"
STUB, AS_STUB = "wrong-stub", "as the stub"

_HEADER = re.compile(r"(?:# (?:title|fails|says|in|seconds|points): .*\n)+")
_LINE = re.compile(r"# (\w+): (.*)\n")
_CELL = re.compile(r"^# %% ([\w-]+)\n", re.MULTILINE)


def load_cases(
    exam: str, folder: Path | None = None, every: Path = exercise_folders.EVERY
) -> list[Case]:
    """Return the cases of an exam, sorted by name.

    Args:
        exam: an exercise that there is.
        folder: the corpus, if it is not the one in the exercise's folder.
        every: the cases that every exam gets.

    Raises:
        CorpusError: it is missing, or a case is not well formed.
    """
    folder = folder or exercise_folders.current_exercises().folders[exam] / exercise_folders.CORPUS
    own, mutants = sorted(folder.glob("*.py")), folder / MUTANTS
    if not own and not mutants.exists():
        raise CorpusError(
            f"There is no corpus for '{exam}': write cases into {folder}, as "
            "notebooks/authoring/README.md says."
        )
    cases = [_read_case(exam, file) for file in own]
    cases += [_read_case(exam, file, every=True) for file in sorted(every.glob("*.py"))]
    cases += _read_mutants(exam, mutants)
    names = [case.name for case in cases]
    for name in names:
        if names.count(name) > 1:
            raise CorpusError(f"The corpus of '{exam}' has two cases called '{name}'.")
    return sorted(_like_the_stub(exam, cases), key=lambda case: case.name)


def _like_the_stub(exam: str, cases: list[Case]) -> Iterator[Case]:
    stub = next((case for case in cases if case.name == STUB), None)
    for case in cases:
        if case.fails != {AS_STUB}:
            yield case
        elif stub is None:
            raise CorpusError(
                f"'{case.name}' must come out as the stub does, but the corpus of '{exam}' has no "
                f"{STUB}.py: write one, as notebooks/authoring/README.md says."
            )
        else:
            yield replace(case, fails=stub.fails, says=stub.says, points=stub.points)


def _read_case(exam: str, file: Path, *, every: bool = False) -> Case:
    text = file.read_text(encoding="utf-8")
    header = _HEADER.match(text)
    fields: dict[str, list[str]] = {}
    for key, value in _LINE.findall(header[0] if header else ""):
        fields.setdefault(key, []).append(value.strip())
    if header is None or "title" not in fields or "fails" not in fields:
        raise CorpusError(f"{file} must begin with the lines '# title: …' and '# fails: …'.")
    says = [line.partition(": ") for line in fields.get("says", [])]
    texts = _split_cells(exam, text[header.end() :])
    in_stub = "in" in fields
    if in_stub and fields["in"] != ["the stub"]:
        raise CorpusError(f"{file}: '# in:' can be 'the stub', not '{fields['in'][0]}'.")
    return Case(
        exam, file.stem, fields["title"][0], _parse_fails(fields["fails"][0]),
        says={check: fragment for check, _, fragment in says},
        cells={} if in_stub else texts, stub=texts if in_stub else {},
        blank=every and not in_stub, cell_timeout=float(fields.get("seconds", [CELL_TIMEOUT_S])[0]),
        points=_parse_points(file, fields["points"][0]) if "points" in fields else None,
    )  # fmt: skip


def _parse_points(file: Path, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise CorpusError(f"{file}: '# points:' is a number, not '{text}'.") from None


def _parse_fails(text: str) -> frozenset[str]:
    if text in (EVERYTHING, ROOTS, AS_STUB):
        return frozenset({text})
    return frozenset() if text == "nothing" else frozenset(re.findall(r"\w+", text))


def _split_cells(exam: str, body: str) -> dict[str, str]:
    first, *rest = _CELL.split(body)
    texts = {solution_cell(exam): first.strip() + "\n"} if first.strip() or not rest else {}
    for grade_id, text in zip(rest[::2], rest[1::2], strict=True):
        texts[grade_id] = text.strip() + "\n"
    return texts


def equivalent_mutations(exam: str) -> dict[str, str]:
    """Return {key of a mutation: why it changes nothing}, as an exercise's corpus says.

    Raises:
        CorpusError: it is no table of texts.
    """
    folder = exercise_folders.current_exercises().folders[exam] / exercise_folders.CORPUS
    file = folder / MUTANTS
    table = _read_tables(file).get(EQUIVALENT, {})
    if not all(isinstance(why, str) for why in table.values()):
        raise CorpusError(f"{file}: [{EQUIVALENT}] says of each mutation why it changes nothing.")
    return dict(table)


def _read_tables(file: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(file.read_text(encoding="utf-8")) if file.exists() else {}
    except tomllib.TOMLDecodeError as error:
        raise CorpusError(f"{file} is not TOML: {error}.") from error


def _read_mutants(exam: str, file: Path) -> Iterator[Case]:
    for name, data in _read_tables(file).items():
        if name == EQUIVALENT:
            continue
        try:
            yield Case(
                exam, name, data["title"], frozenset(data["fails"]), says=data.get("says", {}),
                splices=_parse_splices(exam, data["splices"]),
            )  # fmt: skip
        except (KeyError, TypeError, AttributeError) as error:
            what = f"{error} is missing" if isinstance(error, KeyError) else str(error)
            raise CorpusError(
                f"{file}: mutant '{name}' needs title, fails and splices of old and new: {what}."
            ) from error


def _parse_splices(exam: str, data: list[dict[str, Any]]) -> dict[str, tuple[Splice, ...]]:
    splices: dict[str, tuple[Splice, ...]] = {solution_cell(exam): ()}
    for splice in data:
        cell = splice.get("cell", solution_cell(exam))
        splices[cell] = (*splices.get(cell, ()), (splice["old"], splice["new"]))
    return splices
