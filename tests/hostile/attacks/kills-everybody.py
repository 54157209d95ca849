# title: SIGKILL to every process it may signal
# told: killed by SIGKILL

import os
import signal

try:
    os.kill(-1, signal.SIGKILL)
except ProcessLookupError:
    pass
os.kill(os.getpid(), signal.SIGKILL)
