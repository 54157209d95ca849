# title: All the memory there is
# told: it held more than 1536 MB of memory

hoard = []
while True:
    hoard.append(bytearray(b"x") * (16 * 2**20))
