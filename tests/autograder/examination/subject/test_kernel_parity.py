"""One notebook of probes, in a stock kernel and as it is graded: what comes out is the same."""

from __future__ import annotations

import itertools
import operator
import re
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import nbformat
import pytest
from nbclient import NotebookClient

from autograder.examination.program import Cell
from autograder.running import runner
from autograder.sandbox import sandbox_support
from tests.machine import needs_isolation, needs_warm_starts

pytestmark = [needs_isolation, pytest.mark.xdist_group("kernel"), pytest.mark.timeout(600)]

Output = dict[str, Any]

PROBES = {
    cell.split("\n", 1)[0]: cell.split("\n", 1)[1].strip("\n")
    for cell in Path(__file__).with_name("kernel_probes.ipy").read_text().split("# %% ")[1:]
}
"""Cells by what they are about, in the order in which they are run."""


class Stock(NotebookClient):
    """Runs a notebook in a stock kernel, and shows help as JupyterLab does."""

    def shows_help(self, cell: Any, cell_index: int, execute_reply: Any) -> None:
        pages = [p for p in execute_reply["content"]["payload"] if p["source"] == "page"]
        for page in pages[:1]:
            cell.outputs.append(nbformat.v4.new_output("display_data", data=page["data"]))


@pytest.fixture(scope="module")
def stock(tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[Output]]:
    cells = [nbformat.v4.new_code_cell(source) for source in PROBES.values()]
    notebook = nbformat.v4.new_notebook(cells=cells)
    client = Stock(
        notebook, timeout=60, kernel_name="python3", allow_errors=True,
        resources={"metadata": {"path": str(tmp_path_factory.mktemp("stock"))}},
    )  # fmt: skip
    client.on_cell_executed = client.shows_help
    with pytest.MonkeyPatch.context() as patch:
        patch.delenv("PYTEST_CURRENT_TEST", raising=False)  # ipykernel looks for it
        client.execute()
    outputs = [with_widgets(cell.outputs, client.widget_state) for cell in notebook.cells]
    return dict(zip(PROBES, outputs, strict=True))


def with_widgets(outputs: list[Output], states: dict[str, Any]) -> list[Output]:
    """Return outputs with those of an `Output` widget where it is shown, and without views."""
    found = []
    for output in outputs:
        data = dict(output.get("data", {}))
        view = data.pop("application/vnd.jupyter.widget-view+json", None)
        found.append({**output, "data": data} if "data" in output else output)
        if view is not None:
            inner = states.get(view["model_id"], {}).get("outputs", [])
            found += with_widgets(list(inner), states)
    return found


def graded() -> dict[str, list[Output]]:
    outcome = runner.run(tuple(Cell(source) for source in PROBES.values()))
    return dict(zip(PROBES, outcome.outputs, strict=True))


@pytest.fixture(scope="module")
def warm() -> dict[str, list[Output]]:
    return graded()


@pytest.fixture(scope="module")
def cold() -> Iterator[dict[str, list[Output]]]:
    able = replace(sandbox_support.abilities(), warm=False)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sandbox_support, "abilities", lambda: able)
        yield graded()


CHANGING = {
    r"0x[0-9a-f]+": "0xADDRESS",
    r"/[^\s'\"]*/ipykernel_\d+/(?:\d+-)?\d+\.py": "CELL",
    r"\b(?:\d+-)?\d+\.py(?=, line)": "CELL",
    r"[\d.e+]+ (?:ns|us|[\u00b5\u03bc]s|ms|s)\b": "TIME",
    r"(?:/[^\s'\"]*/stock\d*|/home/student|~)(?=[/'\"\s]|$)": "HOME",
    r"\b[0-9a-f]{32}\b": "ID",
    r"Matplotlib is building the font cache; this may take a moment.\n": "",
    r'(?<=<dc:date>)[^<]*': "DATE",
    r'\b[pmC]?[0-9a-f]{10}\b': "ID",
}  # fmt: skip
"""What differs from run to run."""


UNFLUSHED = ("streams", "bash")
"""Probes that print to both streams and flush neither: how a kernel mixes their texts between two
displays depends on when its threads get to run."""


def normal(name: str, outputs: list[Output]) -> list[Output]:
    """Return what a probe shows in its order, without what differs by nature.

    A stream's text is sent in pieces as threads get to run, but never after what is shown later.
    """
    found: list[Output] = []
    for printed, group in itertools.groupby(outputs, lambda o: bool(o["output_type"] == "stream")):
        some = list(group)
        found += texts(name, some) if printed else [settled(dict(output)) for output in some]
    return found


def texts(name: str, printed: Iterable[Output]) -> list[Output]:
    """Return what was printed between two displays, what follows each other in a stream as one."""
    by_stream = operator.itemgetter("name")
    ordered = sorted(printed, key=by_stream) if name in UNFLUSHED else printed
    found = [
        {stream: settled("".join(output["text"] for output in group))}
        for stream, group in itertools.groupby(ordered, by_stream)
    ]
    return [text for text in found if any(text.values())]


def settled(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: settled(item) for name, item in value.items()}
    if isinstance(value, list):
        # Where Python and its packages are differs, and what raises within a kernel's own code.
        items = [settled(item) for item in value]
        return [item for item in items if not str(item).startswith("File ")]
    if isinstance(value, str):
        value = re.sub(r"\x1b\[[\d;]*m", "", value)
        for pattern, name in CHANGING.items():
            value = re.sub(pattern, name, value)
    return value


@needs_warm_starts
@pytest.mark.parametrize("name", PROBES)
def test_a_cell_shows_the_same_as_in_a_kernel(
    name: str, stock: dict[str, list[Output]], warm: dict[str, list[Output]]
) -> None:
    assert normal(name, warm[name]) == normal(name, stock[name])


@pytest.mark.parametrize("name", PROBES)
def test_a_cell_shows_the_same_without_a_warm_start(
    name: str, stock: dict[str, list[Output]], cold: dict[str, list[Output]]
) -> None:
    assert normal(name, cold[name]) == normal(name, stock[name])


def test_plots_come_as_pictures(warm: dict[str, list[Output]]) -> None:
    for name, kind, count in (
        ("plot without a magic", "image/png", 1),
        ("inline", "image/png", 1),
        ("two figures", "image/png", 2),
        ("show", "image/png", 1),
        ("svg", "image/svg+xml", 1),
    ):
        pictures = [output for output in warm[name] if kind in output.get("data", {})]
        assert len(pictures) == count, name


@pytest.mark.parametrize("kernel", ["stock", pytest.param("warm", marks=needs_warm_starts), "cold"])
def test_what_a_cell_shows_stays_in_its_order(kernel: str, request: pytest.FixtureRequest) -> None:
    outputs = request.getfixturevalue(kernel)["order of all"]
    assert [output.get("text") or min(output["data"]) for output in outputs] == [
        "first\n", "text/plain", "third\n", "image/svg+xml", "fifth\n", "text/html", "seventh\n",
        "text/plain",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("source", "function"),
    [
        ("input('how many? ')", "input"),
        ("import getpass\ngetpass.getpass()", "getpass.getpass"),
        (
            "import asyncio\nasync def ask():\n    input()\nawait asyncio.create_task(ask())",
            "input",
        ),
    ],
)
def test_a_cell_that_waits_for_input_says_that_nobody_types(source: str, function: str) -> None:
    ((output,),) = runner.run((Cell(source),)).outputs
    said = f"{function}() waits for somebody to type, and nobody does while a notebook is graded"
    assert output["ename"] == "StdinNotImplementedError"
    assert output["evalue"].startswith(said)
    assert output["traceback"] == [f"StdinNotImplementedError: {output['evalue']}"]


def test_what_is_written_to_a_descriptor_is_shown_in_its_own_cell() -> None:
    writes = [Cell(f"import os\nos.write(1, b'{number}');") for number in range(100)]
    found = runner.run((*writes,)).outputs
    assert [[output["text"] for output in cell] for cell in found] == [
        [str(number)] for number in range(100)
    ]


def test_a_fork_of_a_cell_prints_into_the_cell() -> None:
    source = """
import os
pid = os.fork()
if pid == 0:
    print('by a fork')
    os._exit(0)
os.waitpid(pid, 0)[1]
"""
    text, value = runner.run((Cell(source),)).outputs[0]
    assert text["text"] == "by a fork\n"
    assert value["data"] == {"text/plain": "0"}


def test_what_a_cell_shows_changes_when_a_later_one_says_so() -> None:
    first, second, third, _ = runner.run(
        (
            Cell("handle = display('one', display_id=True)"),
            Cell("import asyncio\nasync def late():\n    await asyncio.sleep(0)\n"
                 "    print('late')\n"
                 "task = asyncio.create_task(late())"),
            Cell("handle.update('two')\nawait task", "a-test"),
            Cell("handle.update('three')"),
        )
    ).outputs  # fmt: skip
    assert [output["data"]["text/plain"] for output in first] == ["'three'"]
    assert [output["text"] for output in second] == ["late\n"], "as JupyterLab shows it"
    assert third == []


def test_what_a_test_showed_is_its_result_whatever_comes_later() -> None:
    shown, _ = runner.run(
        (
            Cell("request = get_ipython().get_parent()\nassert False, 'no'", "a-test"),
            Cell("from IPython.display import clear_output\n"
                 "get_ipython().set_parent(request)\nclear_output()"),
        )
    ).outputs  # fmt: skip
    assert [output["ename"] for output in shown] == ["AssertionError"]


@pytest.mark.parametrize(
    "source",
    [
        "exit()",
        "import asyncio\nasyncio.get_running_loop().stop()",
        "import asyncio\nasyncio.get_running_loop().call_soon(exit)",
        "import asyncio, sys\nasyncio.get_running_loop().call_soon(sys.exit)",
        "import asyncio\nasync def end():\n    raise KeyboardInterrupt\n"
        "task = asyncio.create_task(end())",
        "import asyncio\n[task.cancel() for task in asyncio.all_tasks()]",
        "import asyncio\nawait asyncio.sleep(0)\n[task.cancel() for task in asyncio.all_tasks()]",
        "import os\nos.fork()",
        "import os\nos.close(1)\nos.close(2)",
    ],
)
def test_the_next_cell_runs_whatever_this_one_does(source: str) -> None:
    outcome = runner.run((Cell(source), Cell("6 * 7")), cell_timeout=20)
    assert [o["data"]["text/plain"] for o in outcome.outputs[1] if "data" in o] == ["42"]
