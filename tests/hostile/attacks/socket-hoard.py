# title: Messages that nobody reads, which the kernel keeps, in every socket that there may be
# told: its processes had more than 2048 files open | there were more than 1200 sockets in its network | it kept more than 4 processes busy at a time

# It is chance which limit it exceeds first: open files, sockets, or busy processes.
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
