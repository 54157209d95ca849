# title: A lock on a file that others need, which takes no right to write to it
# told: it held a lock on a file that is not its own

import fcntl
import os
import time

file = open(os.__file__)
fcntl.flock(file, fcntl.LOCK_EX)
time.sleep(20)
