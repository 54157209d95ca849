# title: Empty files without end: none of them takes room, each takes memory
# told: it had more than 20000 files in /tmp

import os

number = 0
while True:
    os.close(os.open(f"/tmp/{number:06}" + "x" * 200, os.O_CREAT | os.O_WRONLY))
    number += 1
