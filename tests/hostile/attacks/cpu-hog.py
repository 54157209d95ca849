# title: Forty processes that never rest, each in a session of its own
# told: it kept more than 12 processes and threads busy

import os

for _ in range(40):
    if os.fork() == 0:
        os.setsid()
        while True:
            pass
while True:
    os.sched_yield()
