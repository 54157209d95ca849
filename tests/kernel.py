"""A real Jupyter kernel, and cells to run in it."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path
from typing import Any

from jupyter_client import BlockingKernelClient, KernelManager


class Kernel:
    """A kernel of this environment, as a learner's notebook has one.

    It talks over sockets in a folder of its own: ports could be taken by another process between
    choice and use, and jupyter_client's default names are those of every kernel in this folder.
    """

    client: BlockingKernelClient

    def __init__(self) -> None:
        environment = dict(os.environ)
        # The ROS wheels mark a prepared environment; a child has to prepare its own.
        environment.pop("_ROS_WHEELS_BOOTSTRAP_COMPLETE", None)
        self._sockets = tempfile.TemporaryDirectory(prefix="kernel-")
        self.manager = KernelManager(
            kernel_name="python3", transport="ipc", ip=str(Path(self._sockets.name, "ipc"))
        )
        # After half of this time jupyter_client sends SIGTERM, and a kernel that ends by a signal
        # leaves its nodes on the graph. On a busy machine the default of 5 s is too short.
        self.manager.shutdown_wait_time = 60.0
        self.manager.start_kernel(env=environment)
        self.client = self.manager.client()
        self.client.start_channels()
        try:
            self.client.wait_for_ready(timeout=120)
        except BaseException:
            self.close()
            raise

    def run(self, cell: str, timeout: float = 150.0) -> tuple[str, list[tuple[str, str]]]:
        """Run a cell; return its status and what it showed: pairs of kind and text.

        The kinds are stdout, stderr, error, and display for what a cell displays or ends with.
        """
        shown: list[tuple[str, str]] = []

        def take(message: dict[str, Any]) -> None:
            content = message["content"]
            if message["msg_type"] == "stream":
                shown.append((content["name"], content["text"]))
            elif message["msg_type"] in ("display_data", "execute_result"):
                shown.append(("display", content["data"]["text/plain"]))
            elif message["msg_type"] == "error":
                shown.append(("error", "\n".join(content["traceback"])))

        # After an error the kernel would drop what arrives before it has told: each cell is meant.
        reply = self.client.execute_interactive(
            cell, output_hook=take, timeout=timeout, stop_on_error=False
        )
        return reply["content"]["status"], shown

    def close(self) -> None:
        self.client.stop_channels()
        self.manager.shutdown_kernel()
        self._sockets.cleanup()
