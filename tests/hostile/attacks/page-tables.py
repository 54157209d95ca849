# title: Memory that is only addressed: the tables of addresses grow, and nothing else does
# told: it held more than 1536 MB of memory

import ctypes
import os
import time

libc = ctypes.CDLL(None, use_errno=True)
libc.mmap.restype = ctypes.c_void_p
libc.mmap.argtypes = [ctypes.c_void_p, ctypes.c_size_t, *[ctypes.c_int] * 3, ctypes.c_long]


def address(size):
    """Read a byte of each 2 MB: the machine's one page of zeros, and a table for each."""
    start = libc.mmap(None, size, 1, 0x4022, -1, 0)
    if start in (None, ctypes.c_void_p(-1).value):
        raise MemoryError
    for offset in range(0, size, 2 << 20):
        ctypes.c_ubyte.from_address(start + offset).value


try:
    address(200 << 30)
    print("as much as one likes")
except MemoryError:
    pass
for _ in range(28):  # one after the other, or there would be a crowd
    done, tell = os.pipe()
    if os.fork() == 0:
        for _ in range(100):
            try:
                address(1 << 30)
            except MemoryError:
                break
        os.write(tell, b"1")
        while True:
            time.sleep(1)
    os.read(done, 1)
while True:
    time.sleep(1)
