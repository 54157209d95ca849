"""The stubs of rclpy in ``.typings`` are true to the rclpy that is installed."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]


def test_the_stubs_of_rclpy_fit_the_rclpy_that_is_installed(tmp_path: Path) -> None:
    """Names, parameters and their kinds: what an update of rclpy changes shows here."""
    config = tmp_path / "mypy.ini"
    config.write_text(
        f"[mypy]\nmypy_path = {ROOT / '.typings'}\ncache_dir = {tmp_path}\n"
        "[mypy-rcl_interfaces.*]\nignore_missing_imports = true\n"
    )
    compared = subprocess.run(
        [sys.executable, "-m", "mypy.stubtest", "rclpy", "--ignore-missing-stub", "--concise",
         "--mypy-config-file", config],
        cwd=tmp_path, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert compared.stdout + compared.stderr == ""
