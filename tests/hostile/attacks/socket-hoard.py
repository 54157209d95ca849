# title: Messages that nobody reads, which the kernel keeps, in every socket that there may be
# told: its processes had more than 2048 files open | there were more than 1200 sockets in its network

# Which bound is passed at the next look, that on open files or that on sockets, is chance.
import os
import socket

for _ in range(20):
    if os.fork() == 0:
        break
hoard = []
while True:
    try:
        hoard += socket.socketpair()
    except OSError:
        continue
    for end in hoard[-2:]:
        end.setblocking(False)
        try:
            while True:
                end.send(bytes(65536))
        except OSError:
            pass
