"""The import hook: ``from example_interfaces.srv import SetBool`` builds it on first use.

The finder is the last on ``sys.meta_path``: a real ROS installation, or any installed package of
that name, is found before it is asked.
"""

from __future__ import annotations

import importlib.abc
import importlib.machinery
import importlib.util
import sys
import threading
from collections.abc import Sequence
from types import ModuleType

from course.interfaces import bundled, packages, standins
from course.interfaces.building import cache, toolchain
from course.interfaces.building.unit import Unit
from course.interfaces.errors import BuildError, NotDefinedYetError


class Finder(importlib.abc.MetaPathFinder):
    """Finds the bundled packages, and the modules made for learners' own ones."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> importlib.machinery.ModuleSpec | None:
        """Return a spec at once; nothing is built before the module is executed."""
        if fullname in bundled.PACKAGES:
            return packages.package_spec(fullname, BundledLoader())
        if packages.is_ours(fullname):  # importlib.reload asks again
            return packages.package_spec(fullname)
        if fullname.isidentifier() and (names := _defined_before(fullname)):
            return packages.package_spec(fullname, NotYetLoader(names))
        return None


_asking = threading.local()


def _defined_before(package: str) -> list[str]:
    """Ask the cache, unless it is the cache that asks: something that it imports is missing."""
    if getattr(_asking, "now", False):
        return []
    _asking.now = True
    try:
        return cache.defined_before(package)
    except ImportError:  # without its dependencies there is no cache, and nothing in it
        return []
    finally:
        _asking.now = False


class BundledLoader(packages.MadeHere):
    """Loads a bundled package: from the cache, by building it, or as stand-ins."""

    def exec_module(self, module: ModuleType) -> None:
        """Fill the modules of the package, unless a reload asks for it again."""
        package = module.__name__
        unit = bundled.bundled_unit(package)
        if package in standins.reasons or unit.type_names[0] in packages.loaded:
            return
        if cache.find_built(unit) is None and toolchain.compiler_problem() is None:
            _announce_build(package)
        try:
            obtain_unit(unit)
        except BuildError as error:
            standins.load_standins(package, str(error))


class NotYetLoader(packages.MadeHere):
    """Stands for a learner's own package before its cells have run, after a restart above all.

    What the cache holds is not imported by itself: the cell may say something else by now.
    """

    def __init__(self, names: list[str]) -> None:
        """Stand for the package that defines ``names``."""
        self.names = names

    def exec_module(self, module: ModuleType) -> None:
        """Say what to do."""
        cells = " and ".join(f"`%%interface {name}`" for name in self.names[:3])
        one = len(self.names) == 1
        raise NotDefinedYetError(
            f"{module.__name__} is a package of your own, and this kernel does not know it yet: "
            f"run the cell{'' if one else 's'} {cells} first, and then this one again."
        )


def obtain_unit(unit: Unit) -> None:
    """Build ``unit`` if it is not in the cache, and load it.

    Raises ``BuildError``.
    """
    try:
        packages.load_unit(unit, cache.ensure_built(unit))
    except BuildError:
        raise
    except ImportError:
        # It is whole but does not fit: libraries were moved, or replaced by others.
        folder = cache.ensure_built(unit, rebuild=True)
        try:
            packages.load_unit(unit, folder)
        except ImportError as error:
            raise BuildError(
                f"{unit.label} was built and cannot be loaded: {error}. "
                "Reinstalling the ROS packages of this environment may help."
            ) from error


def _announce_build(package: str) -> None:
    """Say in a notebook why the import that has just begun takes so long."""
    shell = sys.modules["IPython"].get_ipython() if "IPython" in sys.modules else None
    if hasattr(shell, "kernel"):
        print(  # noqa: T201 - the cell shows nothing else meanwhile
            f"{package} is being compiled on this machine, as no ROS 2 is installed here. That "
            "takes 5 to 30 seconds, once: it is kept for the next time.",
            flush=True,
        )


def install() -> None:
    """Put the finder last on ``sys.meta_path``, once."""
    if not any(isinstance(finder, Finder) for finder in sys.meta_path):
        sys.meta_path.append(Finder())


def installed_elsewhere(package: str) -> bool:
    """Say whether Python finds ``package`` without us."""
    if package in sys.modules:
        return not packages.is_ours(package)
    if package in sys.stdlib_module_names:
        return True
    try:
        spec = importlib.util.find_spec(package)
    except (ImportError, ValueError):
        return True
    # A namespace package is any folder of that name beside the notebook: it offers nothing.
    return spec is not None and spec.has_location
