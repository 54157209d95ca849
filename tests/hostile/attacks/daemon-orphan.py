# title: Daemons that hold the grader's channels while their parent ends
# told: exit code 3

import os

for _ in range(5):
    if os.fork() == 0:
        os.setsid()
        while True:
            os.read(os.pipe()[0], 1)
os._exit(3)
