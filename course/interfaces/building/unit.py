"""Build a unit: one or more definitions of a package, in one shared library.

The finished folder holds::

    <native>.so      C structs, (de)serialisation, type supports, and the Python extension
    python/<kind>/   the generated Python classes
    include/         C headers and type descriptions, for definitions that refer to these
"""

from __future__ import annotations

import hashlib
import json
import shutil
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from course.interfaces import installed
from course.interfaces.building import toolchain
from course.interfaces.texts.definition import Definition
from course.interfaces.texts.type_names import TypeName

HERE = Path(__file__).parent
# What the generators add to every service and action, beside what a text names.
ALWAYS = {
    "msg": (),
    "srv": ("builtin_interfaces", "service_msgs"),
    "action": ("action_msgs", "builtin_interfaces", "service_msgs", "unique_identifier_msgs"),
}
# The generated handles point to these two; dispatch.c says why they are replaced.
DISPATCH = tuple(
    f"-Drosidl_typesupport_c__get_{what}_typesupport_handle_function="
    f"course_get_{what}_typesupport_handle"
    for what in ("message", "service")
)


@dataclass(frozen=True)
class Unit:
    """Definitions of one package that are built and loaded together.

    ``needs`` are the built units, with their folders, of the same package's messages that these
    definitions refer to.
    """

    package: str
    definitions: tuple[Definition, ...]
    needs: tuple[tuple[Unit, Path], ...] = ()

    @property
    def type_names(self) -> tuple[TypeName, ...]:
        """The names of the interfaces in this unit."""
        return tuple(d.type_name for d in self.definitions)

    @property
    def label(self) -> str:
        """A name for folders and messages: the package, or the only type."""
        return str(self.type_names[0]) if len(self.type_names) == 1 else self.package

    @property
    def digest(self) -> str:
        """Sixteen hexadecimal digits that stand for the texts, those of ``needs`` included."""
        parts = [[str(d.type_name), d.text] for d in self.definitions]
        content = json.dumps([parts, [unit.digest for unit, _ in self.needs]])
        return hashlib.sha256(content.encode()).hexdigest()[:16]

    @property
    def native_name(self) -> str:
        """The name of the extension module, which no other unit shares."""
        return f"_native_{self.digest}"

    @property
    def all_needs(self) -> tuple[tuple[Unit, Path], ...]:
        """The units needed, directly or by others."""
        further = (pair for unit, _ in self.needs for pair in unit.all_needs)
        return tuple({u.digest: (u, folder) for u, folder in (*self.needs, *further)}.values())

    @property
    def used_packages(self) -> tuple[str, ...]:
        """The installed packages whose types are used, theirs included."""
        names = {p for d in self.definitions for p in d.packages}
        names |= {p for d in self.definitions for p in ALWAYS[d.type_name.kind]}
        names |= {p for unit, _ in self.needs for p in unit.used_packages}
        return tuple(sorted(names))


def build_unit(unit: Unit, folder: Path) -> None:
    """Build ``unit`` into the empty ``folder``.

    Raises ``CompilerMissingError``, ``BuildError``, or ``OSError`` if files cannot be written.
    """
    tools = toolchain.find_toolchain()
    scratch = folder / "scratch"
    scratch.mkdir()
    sources = scratch / "sources" / unit.package
    generate_sources(unit, scratch, sources)
    objects = compile_sources(unit, tools, scratch, sources)
    link_library(unit, tools, scratch, objects, folder)
    keep_results(unit, sources, scratch / "introspection", folder)
    shutil.rmtree(scratch)


def generate_sources(unit: Unit, scratch: Path, sources: Path) -> None:
    """Run the generators in a process of their own (generate.py says why)."""
    texts = scratch / "texts" / unit.package
    for definition in unit.definitions:
        file = texts / definition.type_name.relative_path
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(definition.text, encoding="utf-8")
    for _, built in unit.all_needs:
        # The type descriptions of this package's other types are looked up among the sources.
        shutil.copytree(built / "include" / unit.package, sources, dirs_exist_ok=True)
    shares = [installed.prefix_of(p) / "share" / p for p in unit.used_packages]
    request = {
        "package": unit.package,
        "texts": str(texts),
        "files": [t.relative_path for t in unit.type_names],
        "includes": [str(share) for share in shares],
        "sources": str(sources),
        "introspection": str(scratch / "introspection" / unit.package),
    }
    (scratch / "request.json").write_text(json.dumps(request), encoding="utf-8")
    # -P: the folder of generate.py must not become a place that modules are imported from.
    command = [sys.executable, "-P", "-W", "ignore", str(HERE / "generate.py"), "request.json"]
    toolchain.run_commands([command], scratch, unit.label)


def compile_sources(
    unit: Unit, tools: toolchain.Toolchain, scratch: Path, sources: Path
) -> list[Path]:
    """Compile everything in two processes, C and C++; return the object files."""
    includes = toolchain.include_flags((sources.parent, scratch / "introspection"))
    flags = [*toolchain.FLAGS, *DISPATCH, *includes]
    # The entry point of the extension gets this unit's own name.
    module = f"PyInit_{unit.package}_s__rosidl_typesupport_c"
    flags.append(f"-D{module}=PyInit_{unit.native_name}")
    c_files, cxx_files, alone = [HERE / "dispatch.c"], [], []
    for t in unit.type_names:
        parts = sources / t.kind / "detail"
        c_files += [parts / f"{t.file_stem}__functions.c", parts / f"{t.file_stem}__type_support.c"]
        c_files += [sources / t.kind / f"_{t.file_stem}_s.c"]
        cxx_files += [parts / f"{t.file_stem}__type_support_c.cpp"]
        cxx_files += [sources / t.kind / f"{t.file_stem}__type_support.cpp"]
        # These have static names in common with those of other types.
        alone += [parts / f"{t.file_stem}__description.c"]
        alone += [scratch / "introspection" / unit.package / t.kind / "detail"
                  / f"{t.file_stem}__type_support.c"]  # fmt: skip
    c_files.append(sources / f"_{unit.package}_s.ep.rosidl_typesupport_c.c")
    # One compilation of many files reads the headers once: this is three times as fast.
    units = {
        "c": all_of(scratch / "all_c.c", c_files),
        "cxx": all_of(scratch / "all.cpp", cxx_files),
    }
    numbered = [all_of(scratch / f"alone_{n}.c", [f]) for n, f in enumerate(alone)]
    toolchain.run_commands(
        [
            [*tools.cc, "-std=gnu11", *flags, str(units["c"]), *map(str, numbered)],
            [*tools.cxx, "-std=gnu++17", *flags, str(units["cxx"])],
        ],
        scratch,
        unit.label,
    )
    return [scratch / f"{p.stem}.o" for p in (*units.values(), *numbered)]


def all_of(file: Path, parts: Sequence[Path]) -> Path:
    """Write ``file``, which includes all ``parts``."""
    file.write_text("".join(f'#include "{p}"\n' for p in parts), encoding="utf-8")
    return file


def link_library(
    unit: Unit, tools: toolchain.Toolchain, scratch: Path, objects: list[Path], folder: Path
) -> None:
    """Link the objects into the unit's library, against those of the units it needs.

    These are found at run time by their soname: they are loaded already when this one is.
    """
    library = f"{unit.native_name}.so"
    needs = [str(built / f"{needed.native_name}.so") for needed, built in unit.all_needs]
    command = [
        *(*tools.cxx, "-shared", "-s", f"-Wl,-soname,{library}", "-o", str(folder / library)),
        *map(str, objects),
        *(*needs, *toolchain.link_flags(unit.used_packages)),
    ]
    toolchain.run_commands([command], scratch, unit.label)


def keep_results(unit: Unit, sources: Path, introspection: Path, folder: Path) -> None:
    """Copy what is used after the build out of the scratch folder."""
    for t in unit.type_names:
        target = folder / "python" / t.kind
        target.mkdir(parents=True, exist_ok=True)
        shutil.copy(sources / t.kind / f"_{t.file_stem}.py", target)
    for root in (sources.parent, introspection):
        for pattern in ("*.h", "*.json"):
            for file in root.rglob(pattern):
                target = folder / "include" / file.relative_to(root)
                target.parent.mkdir(parents=True, exist_ok=True)
                shutil.copy(file, target)
