"""Defining interfaces of a learner's own, and saying where interfaces come from."""

from __future__ import annotations

import enum

from course.interfaces import bundled, finder, installed, packages, standins
from course.interfaces.building import cache
from course.interfaces.building.toolchain import compiler_problem
from course.interfaces.building.unit import Unit
from course.interfaces.errors import DefinitionError, RestartNeededError
from course.interfaces.texts.definition import Definition, define_text
from course.interfaces.texts.type_names import TypeName, parse_name


class Source(enum.StrEnum):
    """Where the types of a package come from."""

    ROS = "ros"  # installed: a ROS installation's, or a wheel's
    BUILT = "built"  # built from their text by the course
    STAND_IN = "stand-in"  # other types of the same shape
    UNBUILT = "unbuilt"  # the course builds it when it is first imported


def define(name: str, text: str) -> type:
    """Build the interface ``name`` (``package/kind/Name``) from ``text`` and return its type.

    Afterwards ``from package.kind import Name`` works. About 3 s, or 0.1 s if this text was built
    before. Raises ``DefinitionError`` for a mistake in the name or the text, ``BuildError`` if it
    cannot be built, and ``RestartNeededError`` if another definition of ``name`` is in use: that
    one stays in use, and this one is ready for the restarted kernel.
    """
    finder.install()
    type_name = parse_name(name)
    check_package(type_name)
    with packages.lock:
        own = [t for t in packages.loaded if t.package == type_name.package]
    check_stem(type_name, own)
    definition = define_text(type_name, text, [t.name for t in own if t.kind == "msg"])
    unit = unit_of(definition)
    if type_name not in packages.loaded:
        finder.obtain_unit(unit)
    in_use = packages.loaded[type_name]
    if in_use.unit.digest != unit.digest:
        cache.ensure_built(unit)
        raise RestartNeededError(
            f"{type_name} has changed, and the new definition is built, but this kernel has the "
            "old one loaded: restart the kernel and run the cells again to use the new one."
        )
    return in_use.type


def ensure_definition(name: str, text: str) -> None:
    """Build the interface ``name`` from ``text`` into the cache if need be, without loading it.

    Like `ensure`, for a grader that runs programs without a compiler. ``text`` may use installed
    messages only. Raises as `define` does.
    """
    finder.install()
    type_name = parse_name(name)
    check_package(type_name)
    cache.ensure_built(unit_of(define_text(type_name, text, [])))


def unit_of(definition: Definition) -> Unit:
    """Return the unit of a learner's definition, on top of the messages it refers to."""
    package = definition.type_name.package
    needs = [packages.loaded[TypeName(package, "msg", name)].unit for name in definition.own]
    # ensure: somebody may have emptied the cache since they were loaded.
    return Unit(package, (definition,), tuple((unit, cache.ensure_built(unit)) for unit in needs))


def check_package(type_name: TypeName) -> None:
    """Check that the package is the learner's to define."""
    package = type_name.package
    better = f"choose another package name, such as my_{package}/{type_name.kind}/{type_name.name}"
    if package in installed.read_index() or package in bundled.PACKAGES:
        raise DefinitionError(
            f"{package} is an existing ROS package, and redefining its types would break every "
            f"node that uses them: {better}."
        )
    if finder.installed_elsewhere(package):
        raise DefinitionError(f"{package} is an installed Python package: {better}.")


def check_stem(type_name: TypeName, others: list[TypeName]) -> None:
    """Check that no other type has the same file name (HTTPGet and HttpGet do)."""
    for other in others:
        if other != type_name and (other.kind, other.file_stem) == (
            type_name.kind,
            type_name.file_stem,
        ):
            raise DefinitionError(
                f"{type_name} and {other} would share the file name {other.file_stem}: "
                "choose a name that differs in more than its capitals."
            )


def ensure(package: str) -> Source:
    """Build a bundled package into the cache if need be, without importing it.

    For a program that needs it built beforehand, such as a grader that runs programs in a sandbox
    without a compiler. Raises ``DefinitionError`` for an unknown package, and ``BuildError`` if it
    cannot be built: stand-ins are for learners.
    """
    if package not in bundled.PACKAGES:
        raise DefinitionError(
            f"The course does not build {package}; it builds {', '.join(bundled.PACKAGES)}."
        )
    if finder.installed_elsewhere(package):
        return Source.ROS
    cache.ensure_built(bundled.bundled_unit(package))
    return Source.BUILT


def status() -> dict[str, Source]:
    """Return where each package comes from: the bundled ones, and those defined here."""
    found = {t.package: Source.BUILT for t in sorted(packages.loaded)}
    return {package: package_source(package) for package in bundled.PACKAGES} | found


def package_source(package: str) -> Source:
    """Return where a bundled package comes from, or would come from if it were imported now."""
    if finder.installed_elsewhere(package):
        return Source.ROS
    if package in standins.reasons:
        return Source.STAND_IN
    if cache.find_built(bundled.bundled_unit(package)):
        return Source.BUILT
    return Source.STAND_IN if compiler_problem() else Source.UNBUILT
