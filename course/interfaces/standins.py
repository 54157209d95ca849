"""Installed types of the same shape, for a machine that cannot build example_interfaces."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable
from typing import Any

from course.interfaces import bundled, packages
from course.interfaces.errors import InterfaceError
from course.interfaces.texts.type_names import TypeName

# AddTwoInts is not here: no installed service has its fields.
SAME_SHAPE = {
    TypeName("example_interfaces", "srv", "SetBool"): TypeName("std_srvs", "srv", "SetBool"),
    TypeName("example_interfaces", "srv", "Trigger"): TypeName("std_srvs", "srv", "Trigger"),
    TypeName("example_interfaces", "action", "Fibonacci"): TypeName(
        "test_msgs", "action", "Fibonacci"
    ),
}

reasons: dict[str, str] = {}  # package -> why its types are stand-ins in this process


def load_standins(package: str, reason: str) -> None:
    """Fill the modules of ``package`` with stand-ins, and say so once on standard output."""
    for wanted, installed in SAME_SHAPE.items():
        if wanted.package == package:
            source = importlib.import_module(installed.module_name)
            target = packages.ensure_module(wanted.module_name)
            for suffix in packages.EXPORTS[wanted.kind]:
                setattr(target, wanted.name + suffix, getattr(source, wanted.name + suffix))
    for kind in {t.kind for t in bundled.bundled_unit(package).type_names}:
        vars(packages.ensure_module(f"{package}.{kind}"))["__getattr__"] = make_getattr(
            package, kind, reason
        )
    if package not in reasons:
        reasons[package] = reason
        if sys.stdout is not None:
            sys.stdout.write(standin_notice(package, reason) + "\n")


def standin_notice(package: str, reason: str) -> str:
    """Say what stands in, what that costs, and what would mend it."""
    pairs = [(w, s) for w, s in SAME_SHAPE.items() if w.package == package]
    names = ", ".join(str(standin) for _, standin in pairs)
    wanted, standin = pairs[0]
    return (
        f"Note: {package} could not be built on this machine, so installed types with the same "
        f"fields stand in for it: {names}. Your nodes work with each other as they should. What "
        f"it costs: on the network a type is called {standin}, not {wanted}, so another ROS 2 "
        f"program that uses {package} will not talk to yours. The cause and the mend: {reason} "
        "Afterwards restart Python (in a notebook: the kernel)."
    )


def make_getattr(package: str, kind: str, reason: str) -> Callable[[str], Any]:
    """Return the ``__getattr__`` of a module of stand-ins: it explains the types it lacks."""
    lacking = {t.name for t in bundled.bundled_unit(package).type_names if t.kind == kind}

    def __getattr__(name: str) -> Any:  # noqa: N807  Python looks for this name in a module
        if name.partition("_")[0] in lacking:
            raise InterfaceError(
                f"{package}/{kind}/{name.partition('_')[0]} is not available: {package} could not "
                f"be built here, and no installed type has the same fields. {reason}"
            )
        raise AttributeError(f"module '{package}.{kind}' has no attribute '{name}'")

    return __getattr__
