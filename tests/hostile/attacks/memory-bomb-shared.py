# title: Memory that belongs to no process
# told: OSError
# prints: refused: 2

import ctypes
import mmap
import os

libc = ctypes.CDLL(None, use_errno=True)
refused = 0
try:
    os.memfd_create("hoard")
except OSError:
    refused += 1
refused += libc.shmget(0, 2**30, 0o1600) == -1
print("refused:", refused)
for number in range(100_000):
    with open(f"/dev/shm/{number}", "wb") as file:
        file.write(b"x" * 2**20)
