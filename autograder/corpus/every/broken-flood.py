# title: A flood of output, and no node
# fails: the first

import sys

for _ in range(20_000):
    print("passed " * 100)
    print("passed " * 100, file=sys.stderr)
