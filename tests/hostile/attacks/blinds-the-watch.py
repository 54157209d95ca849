# title: A name that is no text, so that whoever watches stumbles over it
# told: it held more than 1536 MB of memory

import os

with open("/proc/self/comm", "wb") as name:
    name.write(b"\xff) R (\xff")
for _ in range(4):
    if os.fork() == 0:
        hoard = bytearray(b"x") * (700 * 2**20)
        while True:
            pass
while True:
    pass
