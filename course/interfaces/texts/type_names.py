"""Names of interfaces: ``package/kind/Name``, and which of them are allowed.

The rules are those of the ROS 2 interface definition ("Conventions" in the page *Interfaces* of
the ROS 2 documentation): package names are lower_case_with_underscores, type names CamelCase.
"""

from __future__ import annotations

import keyword
import re
from dataclasses import dataclass

from course.interfaces.errors import DefinitionError

# How many sections, divided by lines of three dashes, a text of each kind has.
KINDS = {"msg": 1, "srv": 2, "action": 3}

EXAMPLE = "robot_msgs/srv/GetPose"
LOWER_CASE = re.compile(r"[a-z](_?[a-z0-9])*")
CAMEL_CASE = re.compile(r"[A-Z][A-Za-z0-9]*")
UPPER_CASE = re.compile(r"[A-Z](_?[A-Z0-9])*")


@dataclass(frozen=True, order=True)
class TypeName:
    """The full name of an interface, such as ``robot_msgs/srv/GetPose``."""

    package: str
    kind: str
    name: str

    def __str__(self) -> str:
        """Return ``package/kind/Name``."""
        return f"{self.package}/{self.kind}/{self.name}"

    @property
    def module_name(self) -> str:
        """The Python module that the type is imported from: ``robot_msgs.srv``."""
        return f"{self.package}.{self.kind}"

    @property
    def relative_path(self) -> str:
        """The path of its text within the package: ``srv/GetPose.srv``."""
        return f"{self.kind}/{self.name}.{self.kind}"

    @property
    def file_stem(self) -> str:
        """The stem of the generated file names, as rosidl spells it: ``get_pose``."""
        return lower_case(self.name)

    @property
    def import_line(self) -> str:
        """The statement that imports the type."""
        return f"from {self.module_name} import {self.name}"


def lower_case(name: str) -> str:
    """Spell ``GetPose`` as ``get_pose``, by rosidl's own rule."""
    name = re.sub(r"(.)([A-Z][a-z]+)", r"\1_\2", name)
    return re.sub(r"([a-z0-9])([A-Z])", r"\1_\2", name).lower()


def camel_case(name: str) -> str:
    """Spell ``get_pose`` or ``getPose`` as ``GetPose``."""
    return "".join(part[:1].upper() + part[1:] for part in re.split(r"[^A-Za-z0-9]+", name))


def parse_name(text: str) -> TypeName:
    """Read ``package/kind/Name``.

    Raises ``DefinitionError`` with the rule that the name breaks and, where there is an obvious
    one, the spelling that keeps it.
    """
    parts = text.strip().split("/")
    if len(parts) != 3 or not all(parts):
        raise DefinitionError(
            f"{text.strip() or 'An empty name'!s} is not the name of an interface: "
            f"write package/kind/Name, such as {EXAMPLE}."
        )
    package, kind, name = parts
    if kind not in KINDS:
        raise DefinitionError(
            f"{text.strip()}: {kind} is not a kind of interface; "
            f"write msg, srv or action, as in {EXAMPLE}."
        )
    if not LOWER_CASE.fullmatch(package) or keyword.iskeyword(package):
        raise DefinitionError(
            f"{package} is not a valid package name: use lower-case letters, digits and single "
            "underscores, begin with a letter, and avoid Python's own words, as in robot_msgs."
        )
    if not CAMEL_CASE.fullmatch(name):
        better = camel_case(name)
        hint = f" as in {better}" if CAMEL_CASE.fullmatch(better) else f" as in {EXAMPLE}"
        raise DefinitionError(
            f"{name} is not a valid name for an interface: write it in CamelCase, letters and "
            f"digits only,{hint}."
        )
    return TypeName(package, kind, name)
