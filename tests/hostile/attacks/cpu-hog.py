# title: Busy processes, each in a session of its own, which is a share of the processor of its own
# told: it kept more than 4 processes busy at a time | it kept more than 12 processes and threads busy at a time

import os

for _ in range(25):
    if os.fork() == 0:
        os.setsid()
        while True:
            pass
while True:
    pass
