"""What a machine runs short of: for a moment, or until somebody makes room."""

from __future__ import annotations

import errno

from autograder.sandbox import SandboxStartError
from autograder.sandbox.prefork import ZygoteError

_PASSING = {errno.EAGAIN, errno.ENOMEM, errno.EMFILE, errno.ENFILE, errno.ENOBUFS}
_FULL = {errno.ENOSPC, errno.EDQUOT, errno.EROFS}


def is_temporary(error: BaseException | None) -> bool:
    """Whether an error may be over a moment later: no process, no memory to spare just now."""
    if isinstance(error, (SandboxStartError, ZygoteError, MemoryError)):
        return True
    if isinstance(error, OSError):
        return error.errno in _PASSING
    return isinstance(error, RuntimeError) and "can't start new thread" in str(error)


def is_full(error: BaseException | None) -> bool:
    """Whether an error says that nothing more can be written, to a disk that is full perhaps."""
    return isinstance(error, OSError) and error.errno in _FULL
