"""A name that came over the network is a type that is known here, or just a text."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from course.messages import types

EVIL = "raise SystemExit('imported')"


@pytest.mark.parametrize(
    "name", ["std_msgs/msg/String", "test_msgs/action/Fibonacci", "std_srvs/srv/SetBool",
             "test_msgs/action/Fibonacci_FeedbackMessage"],
)  # fmt: skip
def test_a_type_that_is_installed_is_loaded(name: str) -> None:
    assert types.load_named(name).__name__.startswith(name.rpartition("/")[2].partition("_")[0])


@pytest.mark.parametrize(
    "name",
    [
        "submitted.evil.ch05/evil/X", "submitted.evil/msg/X", "taken/msg/Evil", "taken/srv/Evil",
        "os/path/join", "os/msg/Path", "../msg/Evil", "std_msgs/msg/..", "std_msgs/msg/__class__",
        "std_msgs/msg/_string", "std_msgs/String", "std_msgs.msg/msg/String", "", "//",
        "std_msgs/msg/String\n", "xml/action/Dom", "json/msg/X",
    ],
)  # fmt: skip
def test_what_is_no_known_type_is_never_imported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    for package in ("taken", "submitted/evil/ch05", "submitted/evil"):
        folder = tmp_path / package
        folder.mkdir(parents=True, exist_ok=True)
        for module in ("__init__", "msg", "srv", "evil"):
            (folder / f"{module}.py").write_text(EVIL)
    monkeypatch.syspath_prepend(str(tmp_path))
    before = set(sys.modules)
    with pytest.raises(types.UnknownTypeError):
        types.load_named(name)
    assert not {module for module in set(sys.modules) - before if "taken" in module}
