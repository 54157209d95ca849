# title: More output than memory, on every stream
# told: still running after 5 s (line
# seconds: 5

import os
import sys

while True:
    print("x" * 10_000_000)
    print("x" * 10_000_000, file=sys.stderr)
    os.write(1, b"x" * 10_000)
    os.write(2, b"x" * 10_000)
