# title: Memory that belongs to no process
# told: OSError
# prints: refused: 4

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
for file in (-1, os.open("/dev/zero", os.O_RDWR)):
    try:
        hoard = mmap.mmap(file, 2**40)
        for page in range(0, 2**40, mmap.PAGESIZE):
            hoard[page] = 1
            if page % 2**26 == 0:  # let go of, and still there
                hoard.madvise(mmap.MADV_DONTNEED)
    except OSError:
        refused += 1
print("refused:", refused)
for number in range(100_000):
    with open(f"/dev/shm/{number}", "wb") as file:
        file.write(b"x" * 2**20)
