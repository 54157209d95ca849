"""Runs a notebook's code cells in this process: in ipykernel's own kernel, without its sockets.

What a student tried in their kernel behaves the same here: the shell and its magics, the event loop
that runs in and between cells, plots, displays, widgets. Only nobody listens and nobody types: what
the kernel publishes goes into a recording, and comms go nowhere.
"""

# mypy: allow-untyped-calls
# ipykernel and IPython leave most of their functions untyped.

from __future__ import annotations

import asyncio
import contextvars
import logging
import sys
import threading
from collections.abc import Coroutine, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from IPython.core.error import StdinNotImplementedError
from jupyter_client.session import Session
from traitlets import Instance, Type
from traitlets.config import Config

from autograder.examination.subject.captured_output import Publisher, replace_streams
from autograder.examination.subject.recording import Message, Recording

# Nobody debugs at grading. ipykernel would import debugpy: 30 MB, and half a second.
sys.modules.setdefault("debugpy", None)  # type: ignore[arg-type]  # what Python takes for missing
import ipykernel.debugger  # noqa: E402, F401

if sys.modules["debugpy"] is None:
    del sys.modules["debugpy"]

from ipykernel import zmqshell  # noqa: E402
from ipykernel.compiler import XCachingCompiler  # noqa: E402
from ipykernel.ipkernel import IPythonKernel  # noqa: E402
from ipykernel.kernelapp import IPKernelApp  # noqa: E402

BETWEEN_CELLS_S = 0.005
"""How long the tasks of earlier cells have the event loop to themselves before the next cell.

It is about what passes in a kernel that is told to run all cells.
"""


def _put_folder_on_path() -> None:
    """Let cells import files beside the notebook, as in a kernel: after the standard library.

    IPython does so itself, but not in a process of ours, which is started with ``-P``.
    """
    if "" not in sys.path:
        parts = [Path(entry).name in ("site-packages", "dist-packages") for entry in sys.path]
        sys.path.insert(parts.index(True) if True in parts else 0, "")


class _NobodyTypesError(StdinNotImplementedError):
    """What a cell that waits for input raises."""

    def __init__(self, function: str) -> None:
        super().__init__(
            f"{function}() waits for somebody to type, and nobody does while a notebook is graded: "
            "write the value into the cell instead."
        )

    def _render_traceback_(self) -> list[str]:
        """Return what IPython shows: the sentence alone."""
        return [f"{StdinNotImplementedError.__name__}: {self}"]


_NobodyTypesError.__name__ = StdinNotImplementedError.__name__


class ZMQInteractiveShell(zmqshell.ZMQInteractiveShell):
    """ipykernel's shell, under its own name: libraries tell by it that they are in a notebook."""

    first_error: BaseException | None = None

    def _showtraceback(
        self, etype: type[BaseException], evalue: BaseException, stb: list[str]
    ) -> None:
        if self.first_error is None:
            self.first_error = evalue
        try:
            super()._showtraceback(etype, evalue, stb)
        except Exception as unprintable:  # noqa: BLE001 - str() of what a student's code raises
            super()._showtraceback(etype, unprintable, stb)

    @contextmanager
    def _tee(self, channel: str) -> Iterator[None]:
        # IPython 9 would keep a second copy for its history: all that is written, without bounds.
        yield

    def ask_exit(self) -> None:
        """Ignore ``exit``: the rest of the notebook is still run."""


class _Compiler(XCachingCompiler):
    """Gives cells the names that ipykernel does, and their number: `hang_report` reads it."""

    def get_code_name(self, raw_code: str, code: str, number: int) -> str:
        path = Path(super().get_code_name(raw_code, code, number))
        return str(path.with_name(f"{number}-{path.name}"))


class _Session(Session):
    """Puts messages into a recording instead of sending them."""

    recording = Instance(Recording)

    def send(
        self,
        stream: Any,
        msg_or_type: Message | str,
        content: Any = None,
        parent: Any = None,
        ident: Any = None,
        buffers: Any = None,
        track: bool = False,
        header: Any = None,
        metadata: Any = None,
    ) -> Message:
        """Record a message, which is made as `jupyter_client.session.Session.send` makes it."""
        message = msg_or_type
        if isinstance(message, str):
            message = self.msg(message, content, parent, header, metadata)
        self.recording.take_message(message)
        return message


class Kernel(IPythonKernel):
    """A kernel that runs cells one after the other when it is told to."""

    shell_class = Type(ZMQInteractiveShell)
    compiler_class = Type(_Compiler)
    _supports_kernel_subshells = False

    def __init__(self, **traits: Any) -> None:
        """Make one that has not begun: it has no thread, no loop and no file."""
        self._publisher = Publisher()
        super().__init__(
            session=_Session(),
            iopub_thread=self._publisher,
            iopub_socket=self._publisher.background_socket,
            # All that it asks of this thread is which one runs the cells.
            shell_channel_thread=SimpleNamespace(parent_thread=threading.main_thread()),
            **traits,
        )
        self._execute_sleep = 0.0  # it gives its publishing thread a moment, which is none here

    def begin_recording(self, recording: Recording) -> None:
        """Get ready to run cells, and publish to a recording what they show.

        Standard output and error are the kernel's from now on.
        """
        self._recording = recording
        self.session = _Session(recording=recording)
        shell: Any = self.cell_shell
        shell.displayhook.session = shell.display_pub.session = self.session
        self._descriptors = replace_streams(self.session, self._publisher, recording)
        self._loop = asyncio.new_event_loop()
        asyncio.set_event_loop(self._loop)
        self._context = contextvars.copy_context()
        app: Any = self.parent
        # It may have been made where no home of a student's was.
        self.cell_shell.init_ipython_dir(None)
        self.cell_shell.init_profile_dir(None)
        app.init_signal()
        _put_folder_on_path()
        self._run_until_done(self._start_kernel())

    async def _start_kernel(self) -> None:
        self.start()
        self._forward_input()  # for the tasks of cells, and what the examiner starts, as well

    @property
    def cell_shell(self) -> ZMQInteractiveShell:
        """The shell that runs the cells."""
        assert self.shell is not None
        return self.shell  # type: ignore[no-any-return]

    def run_cell(self, source: str, number: int) -> None:
        """Run one cell. Whatever it does, the next one can be run.

        Args:
            source: the cell's text.
            number: which of the notebook's code cells it is, from 0.
        """
        self.cell_shell.execution_count = number + 1
        self._run_until_done(self._request_cell(source, number))
        if asyncio.all_tasks(self._loop):
            self._run_until_done(asyncio.sleep(BETWEEN_CELLS_S))

    def run_beside(self, number: int, call: Any) -> None:
        """Call something in place of a cell: the loop runs meanwhile, as it does for a cell."""

        async def called() -> None:
            self._make_request("", number)
            call()

        self._run_until_done(called())

    async def _request_cell(self, source: str, number: int) -> None:
        request = self._make_request(source, number)
        self.pre_handler_hook()
        try:
            await self.execute_request(None, [], request)
        except Exception as error:  # noqa: BLE001 - of str() of what a student's code raised, say
            failed = {"ename": type(error).__name__, "evalue": "", "traceback": []}
            self.send_response(self.iopub_socket, "error", failed)
        finally:
            self.post_handler_hook()
            self._descriptors.read_pipes(wait=True)  # what is in there is still this cell's

    def _make_request(self, source: str, number: int) -> Message:
        """Make the message that asks for a cell, from which on what is shown is that cell's."""
        content = {
            "code": source, "silent": False, "store_history": True, "user_expressions": {},
            "allow_stdin": False, "stop_on_error": False,
        }  # fmt: skip
        assert self.session is not None
        request: Message = self.session.msg("execute_request", content)
        self._recording.begin_cell(number, request["header"]["msg_id"])
        self.set_parent([], request)
        return request

    def _run_until_done(self, coroutine: Coroutine[Any, Any, None]) -> None:
        """Run the loop until something is done, whatever a cell does to the loop."""
        task = self._loop.create_task(coroutine, context=self._context)
        task.add_done_callback(lambda _: self._loop.stop())
        while not task.done():
            with suppress(SystemExit, KeyboardInterrupt):  # of a task of the student's
                self._loop.run_forever()
        if not task.cancelled() and isinstance(error := task.exception(), Exception):
            raise error

    def raw_input(self, prompt: object = "") -> str:
        """Refuse to wait for nobody."""
        raise _NobodyTypesError("input")

    def getpass(self, prompt: str = "", stream: Any = None, **_: Any) -> str:
        """Refuse to wait for nobody."""
        raise _NobodyTypesError("getpass.getpass")


def make_kernel() -> Kernel:
    """Return this process's kernel: what `ipykernel_launcher` makes, but for sockets and threads.

    It may be made before this process is forked, and must begin after that.
    """
    if Kernel.initialized():
        return Kernel.instance()
    log = logging.Logger("kernel", logging.CRITICAL + 1)  # nobody reads it
    config = Config()
    config.HistoryManager.enabled = False
    config.InteractiveShell.colors = "NoColor"  # they take as long as the rest of a traceback
    app = IPKernelApp.instance(config=config, log=log)
    app.init_pdb()
    kernel = Kernel.instance(parent=app, log=log, user_ns=app.user_ns)
    app.kernel = kernel
    app.init_shell()
    app.init_gui_pylab()
    app.init_extensions()
    kernel.cell_shell.user_ns_hidden.update(kernel.cell_shell.user_ns)
    return kernel
