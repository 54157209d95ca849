"""Python packages made of built units, which can grow while they are in use.

A learner's ``robot_msgs`` starts with one type and gets another from the next cell, so its modules
are made here rather than found on the path: ``robot_msgs``, ``robot_msgs.srv``, and
``robot_msgs.robot_msgs_s__rosidl_typesupport_c``, in which the generated classes look up their
conversion functions.
"""

from __future__ import annotations

import functools
import importlib.abc
import importlib.machinery
import importlib.util
import sys
import threading
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

from course.interfaces.building.unit import Unit
from course.interfaces.errors import BuildError
from course.interfaces.texts.type_names import TypeName

# The names that rosidl's own packages export for an interface.
EXPORTS = {
    "msg": ("",),
    "srv": ("", "_Event", "_Request", "_Response"),
    "action": (
        "",
        *("_GetResult_Event", "_GetResult_Request", "_GetResult_Response"),
        *("_SendGoal_Event", "_SendGoal_Request", "_SendGoal_Response"),
    ),
}

lock = threading.RLock()  # held while the tables below or the modules change


@dataclass(frozen=True)
class Loaded:
    """A type that is in use in this process."""

    unit: Unit
    folder: Path
    type: type


loaded: dict[TypeName, Loaded] = {}


class MadeHere(importlib.abc.Loader):
    """The loader of a module that ``load`` fills; there is nothing to execute."""

    def create_module(self, spec: importlib.machinery.ModuleSpec) -> ModuleType | None:
        """Return the module that exists, so that a reload keeps it."""
        return sys.modules.get(spec.name)

    def exec_module(self, module: ModuleType) -> None:
        """Do nothing."""


def package_spec(name: str, loader: MadeHere | None = None) -> importlib.machinery.ModuleSpec:
    """Return the spec of a package that is made here."""
    spec = importlib.machinery.ModuleSpec(name, loader or MadeHere(), is_package=True)
    spec.submodule_search_locations = []
    return spec


def is_ours(package: str) -> bool:
    """Say whether the imported module ``package`` was made here."""
    spec = getattr(sys.modules.get(package), "__spec__", None)
    return isinstance(getattr(spec, "loader", None), MadeHere)


def ensure_module(name: str) -> ModuleType:
    """Return the module ``name``, made and attached to its parent if it does not exist."""
    if name not in sys.modules:
        made = importlib.util.module_from_spec(package_spec(name))
        made.__doc__ = "ROS interfaces, built from their text."
        vars(made)["__getattr__"] = functools.partial(_once_loaded, made)
        sys.modules[name] = made
        parent, _, child = name.rpartition(".")
        if parent:
            setattr(ensure_module(parent), child, made)
    return sys.modules[name]


def _once_loaded(made: ModuleType, name: str) -> Any:
    """Look a name up that a module does not have yet: another thread may be about to fill it in.

    Python hands a module that is in ``sys.modules`` to every thread, filled or not (PEP 562).
    """
    if not name.startswith("__"):
        with lock:
            if name in vars(made):
                return vars(made)[name]
    raise AttributeError(f"module {made.__name__!r} has no attribute {name!r}")


def load_unit(unit: Unit, folder: Path) -> None:
    """Make the types of a built unit importable; do nothing if another thread just did.

    Raises ``ImportError`` if the library does not load; nothing is left half imported then.
    """
    with lock:
        if all(t in loaded for t in unit.type_names):
            return
        before = set(sys.modules)
        try:
            support = load_native(unit, folder)
            table = ensure_module(f"{unit.package}.{unit.package}_s__rosidl_typesupport_c")
            vars(table).update({k: v for k, v in vars(support).items() if not k.startswith("__")})
            classes = {t: load_classes(t, folder) for t in unit.type_names}
        except BaseException:
            for name in set(sys.modules) - before:
                if name.startswith(f"{unit.package}."):
                    del sys.modules[name]
            raise
        for t in unit.type_names:
            for suffix in EXPORTS[t.kind]:
                setattr(
                    ensure_module(t.module_name),
                    t.name + suffix,
                    getattr(classes[t], t.name + suffix),
                )
            made = getattr(classes[t], t.name)
            loaded[t] = Loaded(unit, folder, made)


def load_native(unit: Unit, folder: Path) -> ModuleType:
    """Load the unit's extension module."""
    name, path = f"{unit.package}.{unit.native_name}", str(folder / f"{unit.native_name}.so")
    loader = importlib.machinery.ExtensionFileLoader(name, path)
    return execute_spec(importlib.util.spec_from_file_location(name, path, loader=loader))


def load_classes(t: TypeName, folder: Path) -> ModuleType:
    """Load the generated Python module of one interface, as ``robot_msgs.srv._get_pose``."""
    parent, path = ensure_module(t.module_name), folder / "python" / t.kind / f"_{t.file_stem}.py"
    made = execute_spec(
        importlib.util.spec_from_file_location(f"{t.module_name}._{t.file_stem}", path)
    )
    setattr(parent, f"_{t.file_stem}", made)
    return made


def execute_spec(spec: importlib.machinery.ModuleSpec | None) -> ModuleType:
    """Create and run the module of ``spec``, which may import itself meanwhile."""
    if spec is None or spec.loader is None:
        raise BuildError("Python does not know how to load a built interface.")
    made = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = made
    spec.loader.exec_module(made)
    return made
