"""The speed of the code that the plan of effects chooses, over that of the code for any scene, in one program.

A scene is traced as planned (special code, see `src/tracer/bsdf/models.rs`; in a scene made grey also paths of one white) and with
everything (general code), in turn, some milliseconds each, so that both have the same share of the machine. Where a linker puts functions
changes the speed of a program by some percent, whatever the functions do; so the program is linked anew with its functions in several
random orders. What is printed is the mean ratio over these orders with its 95 % interval (Student's t over the logarithms), and the
instructions per path by valgrind, where that is installed.
"""

import argparse
import math
import re
import shlex
import shutil
import statistics
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
BUILDS = ROOT / "target" / "effects"

# Scenes with special code, and how they are traced.
PLANNED = [
    ("cornell",),
    ("furnace",),
    ("cornell_spheres",),
    ("cornell", "grey"),
    ("cornell", "bidirectional"),
    ("cove", "bidirectional"),
    ("cornell_spheres", "bidirectional"),
]

# Two-sided 95 % quantiles of Student's t by degrees of freedom; beyond the list that of the normal distribution is near.
T95 = [12.71, 4.30, 3.18, 2.78, 2.57, 2.45, 2.36, 2.31, 2.26, 2.23, 2.20, 2.18, 2.16, 2.14, 2.13, 2.12, 2.11, 2.10, 2.09]


class Worker:
    """A running `benchmarks turns`."""

    def __init__(self, order, *arguments):
        command = [BUILDS / f"benchmarks.{order}", "turns", *arguments]
        self.process = subprocess.Popen(command, cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

    def turn(self, milliseconds):
        """The logarithm of the nanoseconds of a path."""
        self.process.stdin.write(f"{milliseconds}\n")
        self.process.stdin.flush()
        line = self.process.stdout.readline()
        if not line:
            sys.exit(f"{self.process.args[0]} has ended: {self.process.wait()}")
        return math.log(float(line))

    def end(self):
        self.process.stdin.close()
        self.process.wait()


def build(orders):
    """Builds the benchmarks and links it in `orders` random orders of its functions."""
    command = ["cargo", "rustc", "--release", "--locked", "--quiet", "--example", "benchmarks"]
    command += ["--", "-C", "save-temps", "--print", "link-args"]
    linked = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout
    BUILDS.mkdir(parents=True, exist_ok=True)
    lines = [line for line in linked.splitlines() if '"-o"' in line]
    if not lines:
        sys.exit("rustc does not tell how it links; is the compiler not the usual one?")
    for order in range(orders):
        relink(lines[-1], BUILDS / f"benchmarks.{order}", order + 1)


def relink(line, out, seed):
    """Links what rustc has linked once more, with its functions in another order (an option of lld)."""
    line = re.sub(r'"-o" "[^"]*"', lambda _: f'"-o" {shlex.quote(str(out))} "-Wl,--shuffle-sections=.text.*={seed}"', line)
    done = subprocess.run(["bash", "-c", line], capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"linking in random order failed (it takes lld): {done.stderr.strip()}")


def ratios(pairs, rounds, milliseconds):
    """For each pair of workers: the logarithm of how much faster the first is; median over the rounds."""
    for pair in pairs:
        for worker in pair:
            worker.turn(3 * milliseconds)
    logs = [[] for _ in pairs]
    for i in range(rounds):
        for found, (a, b) in zip(logs, pairs):
            if i % 2:
                x, y = a.turn(milliseconds), b.turn(milliseconds)
            else:
                y, x = b.turn(milliseconds), a.turn(milliseconds)
            found.append(y - x)
    for pair in pairs:
        for worker in pair:
            worker.end()
    return [statistics.median(found) for found in logs]


def interval(logs):
    """Mean ratio and its interval."""
    mean, count = statistics.fmean(logs), len(logs)
    t = T95[count - 2] if count - 2 < len(T95) else 1.96
    half = t * statistics.stdev(logs) / math.sqrt(count)
    return math.exp(mean), math.exp(mean - half), math.exp(mean + half)


def instructions(scene, *arguments):
    """Instructions per path, or nothing without valgrind. Sums are exact, so that two lengths are enough."""
    if not shutil.which("valgrind"):
        return None

    # A line asks for a millisecond, in which valgrind traces the 32 paths that come at once and no more.
    def traced(lines):
        command = ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null", BUILDS / "benchmarks.0", "turns", "trace", scene]
        run = subprocess.run([*command, *arguments], cwd=ROOT, input="1\n" * lines, capture_output=True, text=True, check=True)
        return int(re.search(r"Collected : (\d+)", run.stderr)[1])

    return (traced(41) - traced(1)) / (40 * 32)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--orders", type=int, default=12, help="random orders of the functions, at least 2")
    parser.add_argument("--rounds", type=int, default=24, help="turns of each pair, at least 1")
    parser.add_argument("--keep-builds", action="store_true", help="use the builds of the last run")
    arguments = parser.parse_args()
    if arguments.orders < 2 or arguments.rounds < 1:
        parser.error("--orders must be at least 2, --rounds at least 1")
    if not arguments.keep_builds:
        build(arguments.orders)
    print(f"{'special code':<31} as planned / everything")
    for name, *how in PLANNED:
        scene, both = f"scenes/{name}.xml", (how, [*how, "everything"])
        pairs = [[Worker(i, "trace", scene, *words) for words in both] for i in range(arguments.orders)]
        mean, low, high = interval(ratios(pairs, arguments.rounds, 20))
        # A bidirectional index is more than a path, and takes longer than valgrind's millisecond.
        counts = [instructions(scene, *words) for words in both] if not how else [None]
        words = f"{counts[0]:.0f} / {counts[1]:.0f}" if None not in counts else ""
        print(f"{' '.join([name, *how]):<31} {mean:.4f} [{low:.4f}, {high:.4f}]  {words}", flush=True)


if __name__ == "__main__":
    main()
