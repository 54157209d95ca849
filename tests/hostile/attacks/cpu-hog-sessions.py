# title: As many busy processes as may be, each in a session of its own, which is a share of its own
# seconds: 5
# told: was still running after 5 s

import os

for _ in range(3):
    if os.fork() == 0:
        os.setsid()
        while True:
            pass
while True:
    pass
