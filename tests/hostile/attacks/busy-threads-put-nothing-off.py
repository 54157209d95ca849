# title: A cell without end, kept from running by threads of its own that compute in C
# seconds: 6
# told: was still running after 6 s

import hashlib
import threading

BLOCK = bytes(2**26)


def hog():
    while True:
        hashlib.sha256(BLOCK)  # computes without the interpreter's lock


for _ in range(4):
    threading.Thread(target=hog, daemon=True).start()
while True:
    pass
