# title: All the memory there is, in a process whose name is no text
# told: it held more than 1536 MB of memory

with open("/proc/self/comm", "wb") as name:
    name.write(b"\xff\xfe) R 1 \xff")
hoard = []
while True:
    hoard.append(bytearray(b"x") * (16 * 2**20))
