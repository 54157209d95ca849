# title: Processes that start processes, each in a session of its own
# told: it started more than 32 processes

import os

while True:
    try:
        if os.fork() == 0:
            os.setsid()
    except OSError:
        pass
