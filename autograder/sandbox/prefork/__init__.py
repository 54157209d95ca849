"""Warm starts: processes that are forked from one that has imported everything, and run nothing.

Starting Python and importing rclpy, IPython and the course takes a second of processor time, which
is most of what grading a submission costs. A zygote does it once. It has one thread, opens no DDS
participant and never sees a submission; all it ever does is fork. A fork joins the namespaces that
it is told to, gives up every right, and only then runs a module's ``main``, as
``python -P -m MODULE`` would. See unshare(2), setns(2) and pid_namespaces(7).
"""

from autograder.sandbox.prefork.forked import ForkedProcess, ZygoteError
from autograder.sandbox.prefork.zygote_pool import Zygote, ZygotePool, shared

__all__ = ["ForkedProcess", "Zygote", "ZygoteError", "ZygotePool", "shared"]
