"""What describes the image: for Codespaces, VS Code and Binder one file, and in step with pages."""

from __future__ import annotations

import json
import re
from typing import Any

from tests.image.container import ROOT

FOLDER = ROOT / ".devcontainer"
CONTAINERFILE = (FOLDER / "Containerfile").read_text(encoding="utf-8")


def devcontainer() -> dict[str, Any]:
    text = (FOLDER / "devcontainer.json").read_text(encoding="utf-8")
    description: dict[str, Any] = json.loads(re.sub(r"^\s*//.*$", "", text, flags=re.MULTILINE))
    return description


def test_binder_builds_the_same() -> None:
    assert (ROOT / ".binder" / "Dockerfile").read_text(encoding="utf-8") == CONTAINERFILE, (
        "cp .devcontainer/Containerfile .binder/Dockerfile"
    )


def test_codespaces_builds_the_same_as_its_user() -> None:
    build = devcontainer()["build"]
    assert (FOLDER / build["dockerfile"]).read_text(encoding="utf-8") == CONTAINERFILE
    assert (FOLDER / build["context"]).resolve() == ROOT
    user = devcontainer()["remoteUser"]
    assert f"\nUSER {user}\n" in CONTAINERFILE
    assert re.search(rf"useradd .*--uid 1000 .*{user}", CONTAINERFILE), "Binder's user id"
    interpreter = devcontainer()["customizations"]["vscode"]["settings"]
    [environment] = re.findall(r"ENV PATH=(\S+):\$PATH", CONTAINERFILE)
    assert interpreter["python.defaultInterpreterPath"] == f"{environment}/python"


def test_what_is_copied_is_there() -> None:
    for line in re.findall(r"^COPY (?!--from)(.+) \S+$", CONTAINERFILE, re.MULTILINE):
        for name in line.split():
            assert (ROOT / name).exists() or "*" in name, name


def test_the_sandbox_keeps_the_system_calls_that_it_takes() -> None:
    profile = json.loads((FOLDER / "seccomp.json").read_text(encoding="utf-8"))
    assert profile["defaultAction"] == "SCMP_ACT_ALLOW"
    refused = {name for rule in profile["syscalls"] for name in rule["names"]}
    taken = {"clone", "clone3", "unshare", "setns", "mount", "umount2", "pivot_root", "sethostname"}
    assert not refused & taken
    assert refused >= {"bpf", "keyctl", "kexec_load", "init_module", "perf_event_open"}
