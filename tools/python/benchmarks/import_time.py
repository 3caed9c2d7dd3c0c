"""Time of an import in a new process, less that of an empty process: the median of 21 of each, by turns; fails above 0.2 s."""

import statistics
import subprocess
import sys
import time


def seconds(script: str) -> float:
    """Time of a process that runs a script."""
    start = time.perf_counter()
    subprocess.run([sys.executable, "-c", script], check=True)
    return time.perf_counter() - start


pairs = [(seconds("import pointillist"), seconds("pass")) for _ in range(21)]
median = statistics.median(full - empty for full, empty in pairs)
print(f"import pointillist: {1e3 * median:.0f} ms")
sys.exit(median > 0.2)
