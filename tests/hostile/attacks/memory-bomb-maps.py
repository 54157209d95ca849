# title: Memory that children fill, and that is nobody's once they have ended
# prints: refused: 2

import mmap
import os

hoard = []
refused = 0
for file in (lambda: -1, lambda: os.open("/dev/zero", os.O_RDWR)):
    try:
        hoard.append(mmap.mmap(file(), 2**31))
    except OSError:
        refused += 1
print("refused:", refused)
for memory in hoard:
    if (child := os.fork()) == 0:
        for page in range(0, len(memory), mmap.PAGESIZE):
            memory[page] = 1
        os._exit(0)
    os.waitpid(child, 0)
mmap.mmap(-1, 2**20, mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)[0] = 1
