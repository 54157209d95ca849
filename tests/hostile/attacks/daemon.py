# title: A right solution, with daemons that outlive the cell and hold every descriptor
# base: right-chapter
# score: 15

import os

for _ in range(5):
    if os.fork() == 0:
        os.setsid()
        if os.fork() == 0:
            while True:
                os.read(os.pipe()[0], 1)
        os._exit(0)
    os.wait()
