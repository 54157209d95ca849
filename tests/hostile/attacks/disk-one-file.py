# title: One file without end, and files where they do not belong
# prints: refused: 6
# told: OSError

import os
from pathlib import Path

import course

refused = 0
for folder in ("/", "/usr/lib", "/etc", "/dev", str(Path(course.__file__).parent), "/run/handed-in"):
    try:
        Path(folder, "mine").write_text("x")
    except OSError:
        refused += 1
print("refused:", refused)
with open("/tmp/file", "wb") as file:
    while True:
        file.write(b"x" * 2**20)
