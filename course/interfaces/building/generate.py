"""Turn interface texts into C, C++ and Python sources with the rosidl generators.

This file is run as a program, never imported by the package: the generators print, keep global
state and load a template engine, none of which belongs in a learner's kernel. It reads one JSON
request (see ``Request``) and leaves its sources in the folders named there.

The ``rosidl`` command of the wheels cannot be used ("duplicate entry point"), so the generator
classes behind it are called directly.
"""

# mypy: disable-error-code="import-untyped"
from __future__ import annotations

import copy
import ctypes
import json
import os
import signal
import sys
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypedDict


class Request(TypedDict):
    """What to generate: all paths absolute, except ``files``, which start at ``texts``."""

    package: str
    texts: str  # holds msg/, srv/ and action/ with the texts; the IDL files are written there too
    files: list[str]  # "srv/SetBool.srv"
    includes: list[str]  # share folders of the installed packages that the texts refer to
    sources: str  # receives everything but:
    introspection: str  # two generators write files of one name, so this one has its own folder


PR_SET_PDEATHSIG = 1  # <sys/prctl.h>
TYPESUPPORTS = ("rosidl_typesupport_fastrtps_c", "rosidl_typesupport_introspection_c")


def write_idl(texts: Path, package: str, file: Path) -> str:
    """Translate one .msg, .srv or .action text into IDL; return the path rosidl wants."""
    from rosidl_adapter import action, msg, parser, resource, srv

    kind, text = file.suffix[1:], (texts / file).read_text(encoding="utf-8")
    module, parse = {
        "msg": (msg, parser.parse_message_string),
        "srv": (srv, parser.parse_service_string),
        "action": (action, parser.parse_action_string),
    }[kind]
    template = Path(module.__file__).parent.parent / "resource" / f"{kind}.idl.em"
    data = {
        "pkg_name": package,
        "relative_input_file": file.as_posix(),
        kind: parse(package, file.stem, text),
    }
    idl = file.with_suffix(".idl")
    # The template spells each byte of a UTF-8 text as one character; rosidl_adapter writes it thus.
    (texts / idl).write_text(resource.evaluate_template(template.name, data), encoding="iso-8859-1")
    return f"{texts}:{idl.as_posix()}"


def parse_once() -> None:
    """Let the generators share one parse of each IDL file instead of one apiece."""
    from rosidl_parser import parser

    parse, parsed = parser.parse_idl_file, {}

    def cached(locator: Any, png_file: str | None = None) -> Any:
        path = str(locator.get_absolute_path())
        if path not in parsed:
            parsed[path] = parse(locator, png_file)
        return copy.deepcopy(parsed[path])

    parser.parse_idl_file = cached


def die_with_parent() -> None:
    """Ask Linux to end this process when its parent ends, so that no build is orphaned."""
    if sys.platform != "linux":  # there a build goes on to its end
        return
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)


def in_child(work: Callable[[], None]) -> int:
    """Run ``work()`` in a forked child and return its process id.

    Template expansion is pure Python and takes most of the time, so it is shared by two processes.
    """
    sys.stdout.flush()
    sys.stderr.flush()
    child = os.fork()
    if child == 0:
        status = 1
        try:
            die_with_parent()
            work()
            status = 0
        except Exception:  # noqa: BLE001  nothing is above this: the child ends here
            traceback.print_exc()  # its last line is what the builder reports
        finally:
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(status)
    return child


def one_half(request: Request, idl: list[str]) -> None:
    """Write type hashes, C structs, and what picks a type support and describes it."""
    from rosidl_generator_c.cli import GenerateC
    from rosidl_generator_type_description.cli import HashTypeDescription
    from rosidl_typesupport_c.cli import GenerateCTypesupport
    from rosidl_typesupport_introspection_c.cli import GenerateIntrospectionCTypesupport

    package, includes, sources = request["package"], request["includes"], Path(request["sources"])
    hashes = HashTypeDescription("hash").generate_type_hashes(package, idl, includes, sources)
    GenerateC("c").generate(package, idl, includes, sources, type_description_files=hashes)
    GenerateCTypesupport("typesupport", typesupport_implementations=list(TYPESUPPORTS)).generate(
        package, idl, includes, sources
    )
    GenerateIntrospectionCTypesupport("introspection").generate(
        package, idl, includes, Path(request["introspection"])
    )


def other_half(request: Request, idl: list[str]) -> None:
    """Write the (de)serialisation for DDS, and the Python classes with their conversions."""
    from rosidl_generator_py.cli import GeneratePython
    from rosidl_typesupport_fastrtps_c.cli import GenerateFastRTPSCTypesupport

    package, includes, sources = request["package"], request["includes"], Path(request["sources"])
    GenerateFastRTPSCTypesupport("fastrtps").generate(package, idl, includes, sources)
    GeneratePython("python", typesupport_implementations=["rosidl_typesupport_c"]).generate(
        package, idl, includes, sources
    )


def write_sources(request: Request) -> None:
    """Write all sources for ``request``."""
    parse_once()
    texts = Path(request["texts"])
    idl = [write_idl(texts, request["package"], Path(file)) for file in request["files"]]
    child = in_child(lambda: other_half(request, idl))
    try:
        one_half(request, idl)
    except BaseException:
        os.kill(child, signal.SIGKILL)  # or it would go on writing to a folder that is given up
        raise
    finally:
        _, status = os.waitpid(child, 0)
    if status:
        raise SystemExit(1)


if __name__ == "__main__":
    die_with_parent()
    write_sources(json.loads(Path(sys.argv[1]).read_text(encoding="utf-8")))
