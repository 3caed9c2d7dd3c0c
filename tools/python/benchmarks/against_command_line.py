"""A render from Python against one by the program, each in a process of its own, by turns: the ratio of times with its 90 % interval.

    python against_command_line.py PROGRAM SCENE [TURNS]

Both load the scene, render it with 64 samples per pixel on the CPU and have an EXR file at the end. Fails if the ratio is above 1.02 beyond its
interval. Build both with the same profile: `maturin develop --release`, `cargo build --release`.
"""

import math
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

program, scene = sys.argv[1:3]
turns = int(sys.argv[3]) if len(sys.argv) > 3 else 15
script = "import pointillist, sys; pointillist.load(sys.argv[1]).render(spp=64).save(sys.argv[2])"


def seconds(words: list[str]) -> float:
    """Time of a process."""
    start = time.perf_counter()
    subprocess.run(words, check=True)
    return time.perf_counter() - start


with tempfile.TemporaryDirectory() as folder:
    file = str(Path(folder) / "picture.exr")
    python = [sys.executable, "-c", script, scene, file]
    native = [program, "render", scene, "--spp", "64", "--device", "cpu", "--quiet", "-o", file]
    logs = []
    for turn in range(turns):
        # Which comes first changes, so that what the machine does meanwhile hits both.
        order = [python, native] if turn % 2 else [native, python]
        times = {words[0]: seconds(words) for words in order}
        logs.append(math.log(times[sys.executable] / times[program]))
mean, error = statistics.mean(logs), statistics.stdev(logs) / math.sqrt(turns)
low, high = (math.exp(mean + sign * 1.76 * error) for sign in (-1, 1))
print(f"Python over the program: {math.exp(mean):.3f} ({low:.3f}–{high:.3f})")
sys.exit(low > 1.02)
