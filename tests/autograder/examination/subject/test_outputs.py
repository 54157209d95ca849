"""What is kept of a cell's outputs, and how what cells publish becomes outputs: pure decisions."""

from __future__ import annotations

import os
from typing import Any

import pytest

from autograder.examination.subject import outputs
from autograder.examination.subject.outputs import (
    MAX_SHOWN_BYTES,
    MAX_TEXT_CHARS,
    Output,
    OutputNotebook,
    of_test,
)
from autograder.examination.subject.recording import MAX_WIDGETS, Recording
from autograder.processes.channel import MAX_LINE_BYTES

VIEW = "application/vnd.jupyter.widget-view+json"


class Cells:
    """Publishes to a recording as cells do."""

    def __init__(self) -> None:
        self.recording = Recording()

    def begin(self, number: int) -> None:
        self.now = str(number)
        self.recording.begin_cell(number, self.now)

    def send(self, kind: str, **content: Any) -> None:
        header = {"msg_type": kind}
        parent = {"msg_id": self.now}
        self.recording.take_message({"header": header, "parent_header": parent, "content": content})

    def show(self, data: dict[str, Any], display_id: str = "", kind: str = "display_data") -> None:
        self.send(kind, data=data, metadata={}, transient={"display_id": display_id})

    def write(self, text: str, name: str = "stdout") -> None:
        if kept := self.recording.reserve_room(name, self.now, len(text)):
            self.send("stream", name=name, text=text[:kept])

    def error(self, name: str = "ValueError", value: str = "no") -> None:
        self.send("error", ename=name, evalue=value, traceback=[f"{name}: {value}"])

    def widget(self, model: str, **state: Any) -> None:
        self.send("comm_open", comm_id=model, data={"state": {"_model_name": "OutputModel"}})
        self.show({"text/plain": "Output()", VIEW: {"model_id": model}})

    def within(self, model: str, *, inside: bool) -> None:
        self.send("comm_msg", comm_id=model, data={"state": {"msg_id": self.now * inside}})

    def shown(self, number: int) -> list[Output]:
        return self.recording.take_changes()[number]

    def texts(self, number: int) -> list[str]:
        found = self.shown(number)
        return [o["text"] if "text" in o else o["data"]["text/plain"] for o in found]


@pytest.fixture
def cells() -> Cells:
    made = Cells()
    made.begin(0)
    return made


def test_streams_are_joined_in_the_order_in_which_they_come(cells: Cells) -> None:
    for text, name in (("a", "stdout"), ("b", "stdout"), ("c", "stderr"), ("d", "stdout")):
        cells.write(text, name)
    assert [(o["name"], o["text"]) for o in cells.shown(0)] == [
        ("stdout", "ab"), ("stderr", "c"), ("stdout", "d"),
    ]  # fmt: skip


def test_of_each_stream_the_beginning_is_kept(cells: Cells) -> None:
    for _ in range(3):
        cells.write("x" * MAX_TEXT_CHARS)
    cells.write("y", "stderr")
    first, second = cells.texts(0)
    assert (
        first
        == "x" * MAX_TEXT_CHARS + f"\n[{2 * MAX_TEXT_CHARS} more characters were cut off here]\n"
    )
    assert second == "y"


def test_what_was_cleared_takes_no_room(cells: Cells) -> None:
    for step in range(100):
        cells.send("clear_output", wait=True)
        cells.write(f"{step} " + "x" * MAX_TEXT_CHARS)
    (text,) = cells.texts(0)
    assert text.startswith("99 x")
    cells.send("clear_output", wait=False)
    assert cells.shown(0) == []


def test_a_display_is_updated_wherever_it_is_shown(cells: Cells) -> None:
    cells.show({"text/plain": "one"}, "mine")
    cells.show({"text/plain": "other"}, "other")
    assert cells.texts(0) == ["one", "other"]
    cells.begin(1)
    cells.show({"text/plain": "two"}, "mine", "update_display_data")
    cells.show({"text/plain": "nobody's"}, "", "update_display_data")
    assert cells.recording.take_changes().keys() == {0, 1}
    cells.show({"text/plain": "three"}, "mine", "update_display_data")
    assert cells.texts(0) == ["three", "other"]
    assert cells.recording.take_changes() == {}


def test_updates_that_grow_are_bounded(cells: Cells) -> None:
    for number in range(100):
        cells.show({"text/plain": "x"}, str(number))
        cells.show({"text/plain": "x" * MAX_SHOWN_BYTES}, str(number), "update_display_data")
    cells.error()
    found = cells.shown(0)
    assert outputs.json_size({"all": found}) < MAX_LINE_BYTES
    assert found[-1]["ename"] == "ValueError"


def test_an_error_is_kept_whatever_came_before_it(cells: Cells) -> None:
    for _ in range(10_000):
        cells.show({"text/plain": "x" * 1000})
    cells.error(value="v" * 10 * MAX_TEXT_CHARS)
    *_, note, error = cells.shown(0)
    assert note["text"] == outputs.CUT
    assert error["ename"] == "ValueError"
    assert len(error["evalue"]) < MAX_TEXT_CHARS + 100


def test_whatever_a_cell_shows_fits_into_a_message(cells: Cells) -> None:
    for _ in range(100):
        cells.write("\x01" * MAX_TEXT_CHARS)
        cells.write("\x01" * MAX_TEXT_CHARS, "stderr")
        cells.show({"text/plain": "\x01" * 10_000})
        cells.error(value="\x01" * MAX_TEXT_CHARS)
    found = cells.shown(0)
    assert outputs.json_size({"all": found}) < MAX_LINE_BYTES
    assert any(map(outputs.is_error, found))


def test_what_a_widget_captures_is_shown_where_it_is(cells: Cells) -> None:
    cells.widget("out")
    cells.within("out", inside=True)
    cells.write("within")
    cells.within("out", inside=False)
    cells.write("beside")
    assert cells.texts(0) == ["Output()", "within", "beside"]
    cells.begin(1)
    cells.within("out", inside=True)
    cells.send("clear_output", wait=False)
    cells.show({"text/plain": "later"})
    assert cells.texts(0) == ["Output()", "later", "beside"]


def test_widgets_that_show_each_other_come_to_an_end(cells: Cells) -> None:
    for model, other in (("a", "b"), ("b", "a")):
        cells.widget(model)
        cells.within(model, inside=True)
        for _ in range(100):
            cells.show({"text/plain": "Output()", VIEW: {"model_id": other}})
        cells.within(model, inside=False)
    assert outputs.json_size({"all": cells.shown(0)}) < MAX_LINE_BYTES


def test_of_widgets_there_are_only_so_many(cells: Cells) -> None:
    for number in range(2 * MAX_WIDGETS):
        cells.send("comm_open", comm_id=str(number), data={"state": {"_model_name": "OutputModel"}})
    assert len(cells.recording._widgets) == MAX_WIDGETS


def test_a_forked_process_shows_nothing(cells: Cells, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "getpid", lambda: 1)
    cells.show({"text/plain": "of a fork"})
    assert cells.shown(0) == []


DEEP: Any = []
for _ in range(100):
    DEEP = [DEEP]


@pytest.mark.parametrize(
    ("data", "kept"),
    [
        ({"text/plain": "x"}, True),
        ({"text/plain": 5}, False),
        ({"application/json": {"a": [1, None]}}, True),
        ({"application/vnd.vega.v5+json": {"a": 1}}, True),
        ({"application/json": DEEP}, False),
        ({"application/json": float("nan")}, False),
        ({5: "x"}, False),
    ],
)
def test_only_data_that_a_notebook_can_hold_are_kept(data: Any, kept: bool) -> None:
    assert bool(outputs.displayable_data(data, {})[0]) == kept
    output = {"output_type": "display_data", "data": data, "metadata": {}}
    assert outputs.is_output(output) == kept


def test_of_what_is_said_about_data_only_simple_values_are_kept() -> None:
    about = {
        "image/png": {"width": 300, "height": "50%", "alt": "<b>", "needs_background": "light"},
        "text/html": {"isolated": True},
        "width": 5,
    }
    _, kept = outputs.displayable_data({"image/png": "x"}, about)
    assert kept == {"image/png": {"width": 300, "height": "50%", "needs_background": "light"}}


@pytest.mark.parametrize(
    ("text", "kind"),
    [("0.5", "execute_result"), ("0", "execute_result"), ("1.5", "display_data"),
     ("nan", "display_data"), ("-1", "display_data"), ("'right'", "display_data"),
     (None, "display_data")],
)  # fmt: skip
def test_nbgrader_is_given_a_score_that_it_can_take(text: str | None, kind: str) -> None:
    value: Output = {
        "output_type": "execute_result", "data": {"text/plain": text} if text else {},
        "metadata": {}, "execution_count": 3,
    }  # fmt: skip
    ((output),) = of_test([value], 1.0)
    assert output["output_type"] == kind
    assert outputs.is_output(output)


def test_of_outputs_beyond_the_bound_of_a_notebook_the_errors_are_left() -> None:
    notebook = OutputNotebook([[] for _ in range(20)])
    for number in range(20):
        notebook.put_outputs(
            number, [outputs.stream_output("x" * 10**6), outputs.error_output("E", "no", [])]
        )
    assert notebook.cut
    assert notebook.cells[0][0]["output_type"] == "stream"
    assert [output["ename"] for output in notebook.cells[-1]] == ["E"]
