# title: Memory of processes whose first thread has ended, so that they seem to hold nothing
# told: it held more than 1536 MB of memory

import ctypes
import os
import threading

hoard = []


def hold():
    while ") Z" not in open("/proc/self/stat").read():
        pass
    hoard.append(bytearray(b"x") * (700 * 2**20))
    threading.Event().wait()


for _ in range(4):
    if os.fork() == 0:
        threading.Thread(target=hold).start()
        ctypes.CDLL(None).syscall(60, 0)  # exit, not exit_group
threading.Event().wait()
