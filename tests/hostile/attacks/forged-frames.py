# title: A process that hangs and says that it is in the grader's own code
# told: Code cell 3 was still running after 5 s (line 352 of
# seconds: 5

import faulthandler
import os
import queue
import signal


def forge(*_):
    frames = "Current thread 0x00 (most recent call first):\n"
    frames += '  File "course/runtime/nodes/node_registry.py", line 352 in stop\n'
    frames += '  File "autograder/examination/subject/process.py", line 62 in run\n'
    for descriptor in range(3, 64):
        try:
            os.write(descriptor, frames.encode())
        except OSError:
            pass


faulthandler.unregister(signal.SIGUSR1)
signal.signal(signal.SIGUSR1, forge)
queue.SimpleQueue().get()
