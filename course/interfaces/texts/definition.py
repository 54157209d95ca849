"""The text of one interface, checked line by line."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

from course.interfaces.errors import DefinitionError
from course.interfaces.texts.definition_lines import DefinitionLine, LineError, parse_line
from course.interfaces.texts.type_names import KINDS, TypeName

SECTIONS = {
    "srv": "one line of three dashes (---) between the request and the response",
    "action": "two lines of three dashes (---): goal, ---, result, ---, feedback",
}


@dataclass(frozen=True)
class Definition:
    """A checked interface text.

    ``text`` is what is built: the learner's text without comments and blanks, so that a changed
    comment neither rebuilds nor asks for a restart. ``own`` names the messages of the same
    package that the text refers to; ``packages`` the installed packages.
    """

    type_name: TypeName
    text: str
    own: tuple[str, ...]
    packages: tuple[str, ...]


def define_text(type_name: TypeName, text: str, own_messages: Collection[str] = ()) -> Definition:
    """Check the text of ``type_name``.

    ``own_messages`` are the messages that its package has already. Raises ``DefinitionError``:
    type, line number, the line, and what was expected there.
    """
    sections: list[list[DefinitionLine]] = [[]]
    kept: list[str] = []
    for number, raw in enumerate(text.splitlines(), start=1):
        line = " ".join(raw.partition("#")[0].split("\t")).strip()
        if not line:
            continue
        try:
            if set(line) == {"-"}:
                check_separator(line, type_name, len(sections))
                sections.append([])
            else:
                entry = parse_line(line, type_name.package, own_messages)
                check_new(entry, sections[-1], type_name)
                sections[-1].append(entry)
        except LineError as error:
            where = f"{type_name}, line {number} (`{line}`)"
            end = "" if str(error).endswith("?") else "."
            raise DefinitionError(f"{where}: {error}{end}") from None
        kept.append(line)
    if len(sections) != KINDS[type_name.kind]:
        raise DefinitionError(
            f"{type_name}: expected {SECTIONS[type_name.kind]}; found {len(sections) - 1}."
        )
    references = {e.reference for section in sections for e in section if e.reference}
    return Definition(
        type_name,
        "\n".join(kept) + "\n",
        own=tuple(sorted(name for package, name in references if package == type_name.package)),
        packages=tuple(sorted({p for p, _ in references} - {type_name.package})),
    )


def check_separator(line: str, type_name: TypeName, sections: int) -> None:
    """Check a line of dashes that ends section number ``sections``."""
    if line != "---":
        raise LineError("expected exactly three dashes")
    if type_name.kind == "msg":
        raise LineError("a message has one part, without dashes; a service has two")
    if sections == KINDS[type_name.kind]:
        raise LineError(f"expected {SECTIONS[type_name.kind]}; this is one too many")


def check_new(entry: DefinitionLine, section: list[DefinitionLine], type_name: TypeName) -> None:
    """Check that ``entry`` is the first of its name, and no message that holds itself."""
    if any(e.name == entry.name for e in section):
        raise LineError(f"the name {entry.name} is used twice in this part")
    if entry.reference == (type_name.package, type_name.name) and type_name.kind == "msg":
        raise LineError("a message cannot contain itself")
