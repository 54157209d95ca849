# title: Puts code into the cache that others load
# prints: written: 0

from pathlib import Path

from course.interfaces.building import cache

written = 0
for folder in (cache.root(), *cache.root().rglob("*")):
    try:
        (Path(folder) / "poison.py").write_text("raise SystemExit")
        written += 1
    except OSError:
        pass
print("written:", written)
