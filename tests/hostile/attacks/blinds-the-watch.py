# title: A name that is no text, so that whoever watches stumbles over it
# told: it held more than 1536 MB of memory

import ctypes
import os

ctypes.CDLL(None).prctl(15, b"\xff) R (\xff", 0, 0, 0)
for _ in range(3):
    if os.fork() == 0:
        hoard = bytearray(b"x") * (700 * 2**20)
        while True:
            pass
while True:
    pass
