"""Memory over many renders in one process: prints it on the way, and fails if it grows.

    python growth.py [COUNT]        10000 renders of 8×8 pixels unless told otherwise
"""

import sys
import time
from pathlib import Path

import pointillist


def resident() -> float:
    """MiB of memory in use."""
    return int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1]) * 4096 / 2**20


count = int(sys.argv[1]) if len(sys.argv) > 1 else 10_000
scene = pointillist.load(pointillist.cornell_box())
start, before = time.monotonic(), 0.0
for number in range(1, count + 1):
    scene.render(spp=1, size=(8, 8), seed=number)["picture"]
    # The first tenth fills what is kept, such as tables and arenas of threads.
    if number == max(count // 10, 1):
        before = resident()
    if number % max(count // 10, 1) == 0:
        print(f"{number:6} renders  {resident():8.1f} MiB  {time.monotonic() - start:7.1f} s", flush=True)
grown = resident() - before
print(f"grown by {grown:.1f} MiB")
sys.exit(grown > 8)
