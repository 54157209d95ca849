# title: A cell without end, kept from running by children of its own that nobody waits for
# seconds: 6
# told: was still running after 6 s

import os
import signal
import threading
import time

signal.signal(signal.SIGCHLD, signal.SIG_IGN)


def hog():
    while True:
        ended, end = os.pipe()
        if os.fork() == 0:
            began = time.monotonic()
            while time.monotonic() - began < 1.0:
                pass
            os._exit(0)
        os.close(end)
        os.read(ended, 1)
        os.close(ended)


for _ in range(3):
    threading.Thread(target=hog, daemon=True).start()
while True:
    pass
