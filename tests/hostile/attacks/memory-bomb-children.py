# title: Each child holds what one process may hold
# told: it held more than 1536 MB of memory

import os
import signal

for _ in range(4):
    if os.fork() == 0:
        hoard = bytearray(b"x") * (700 * 2**20)
        signal.pause()
signal.pause()
