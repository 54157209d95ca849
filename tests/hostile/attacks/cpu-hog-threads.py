# title: Busy threads that need no interpreter, in a process whose first thread has ended
# told: it kept more than 12 processes and threads busy at a time

import ctypes
import hashlib
import os
import threading


def busy():
    while True:
        hashlib.pbkdf2_hmac("sha256", b"", b"", 10_000_000)


if os.fork() == 0:
    for _ in range(100):
        threading.Thread(target=busy).start()
    ctypes.CDLL(None).syscall(60, 0)  # exit, not exit_group
while True:
    pass
