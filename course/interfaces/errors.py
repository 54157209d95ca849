"""What can go wrong with interfaces, as sentences for the person at the notebook."""

from __future__ import annotations

from course.errors import CourseError


class InterfaceError(CourseError, ImportError):
    """An interface cannot be defined, built or imported.

    It is an ``ImportError`` too, because most are raised by an ``import`` statement.
    """


class DefinitionError(InterfaceError):
    """The text or the name of an interface is wrong; the message names the line."""


class BuildError(InterfaceError):
    """The generators or the compiler could not build an interface."""


class CompilerMissingError(BuildError):
    """There is no C or C++ compiler, or no Python headers."""


class RestartNeededError(InterfaceError):
    """A definition changed while the old one is loaded; a process can hold only one of them."""


class NotDefinedYetError(InterfaceError, ModuleNotFoundError):
    """A package is imported whose ``%%interface`` cell has not run in this kernel."""
