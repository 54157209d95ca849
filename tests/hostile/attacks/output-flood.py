# title: Output without end, on every stream
# told: still running
# seconds: 5

import os
import sys

while True:
    print("x" * 1000)
    print("x" * 1000, file=sys.stderr)
    os.write(1, b"x" * 10_000)
    os.write(2, b"x" * 10_000)
