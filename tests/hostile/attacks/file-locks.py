# title: Locks on parts of a file without end: the kernel keeps each, and no limit counts them
# told: it held more than 5000 locks on files

import fcntl

with open("/tmp/locked", "w") as file:
    number = 0
    while True:
        fcntl.lockf(file, fcntl.LOCK_EX, 1, number)
        number += 2
