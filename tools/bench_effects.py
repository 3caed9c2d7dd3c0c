"""What an effect costs that is off: the whole program against builds that lack one effect, on a scene without it, in turn.

For each effect a build is made in which its code is not there at all (POINTILLIST_WITHOUT=effect, `glsl/build.rs`). Where a linker
puts functions changes the speed of a program by some percent, whatever the functions do; so every build is linked anew with its
functions in several random orders, each order of one build is paired with one of the other, and what is said is the mean over these
pairs, with its 95 % interval (Student's t over the logarithms). Both answer in turn, some milliseconds each, for the same weather.

Ratios are speed of the whole program over that of the build without; 1 is what is wanted. Beside them: instructions per path by
valgrind, where it is installed, the price of each effect in a scene that has it, as `pointillist explain` measures it, and the time
from start to end of a program that only makes a scene ready. Then: paths per second as planned over those with everything (special
code, see `src/tracer/bsdf/scattering.rs`; in a scene made grey also the paths of one white).
"""

import argparse
import json
import math
import os
import re
import shlex
import shutil
import statistics
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
BUILDS = ROOT / "target" / "effects"

# Effect of the tracer: a scene without it; a scene with it.
TRACER = {
    "dispersion": ("cornell_spheres", "prism"),
    "transmission": ("veach_plates", "cornell_spheres"),
    "deltas": ("cornell", "cornell_spheres"),
    "glossy": ("cornell_spheres", "veach_plates"),
    "environment": ("cornell", "rough"),
    "light-choice": ("cornell", "veach_plates"),
    "lens": ("cornell", None),
}

# Effects of the client: none of them is in the plain picture that `turns paint` makes. They are left out together: what all of them
# cost is more than what each does.
CLIENT = "variance,masking,light-stream,glare,dither"

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
    """A running `turns`."""

    def __init__(self, build, order, *arguments):
        command = [BUILDS / f"{build}.{order}", *arguments]
        self.process = subprocess.Popen(command, cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

    def turn(self, milliseconds):
        """The logarithm of the nanoseconds of a path or frame."""
        self.process.stdin.write(f"{milliseconds}\n")
        self.process.stdin.flush()
        line = self.process.stdout.readline()
        if not line:
            sys.exit(f"{self.process.args[0]} has ended: {self.process.wait()}")
        return math.log(float(line))

    def end(self):
        self.process.stdin.close()
        self.process.wait()


def build(name, orders, client):
    """`turns` without the effect `name` ("whole": with all), linked in `orders` random orders; that of the client in one."""
    env = {k: v for k, v in os.environ.items() if k != "POINTILLIST_WITHOUT"}
    if name not in ("whole", "whole-client"):
        env["POINTILLIST_WITHOUT"] = CLIENT if client else name
    command = ["cargo"]
    if client:
        command += ["--config", "tools/shaderc-debian.toml"]
    command += ["rustc", "--release", "--locked", "--quiet", "--example", "turns"]
    if client:
        command += ["--features", "shaderc"]
    command += ["--", "-C", "save-temps", "--print", "link-args"]
    print(f"building {name}", file=sys.stderr)
    linked = subprocess.run(command, cwd=ROOT, env=env, check=True, capture_output=True, text=True).stdout
    BUILDS.mkdir(parents=True, exist_ok=True)
    if client:
        shutil.copy2(ROOT / "target" / "release" / "examples" / "turns", BUILDS / f"{name}.0")
        return
    lines = [line for line in linked.splitlines() if '"-o"' in line]
    if not lines:
        sys.exit("rustc does not tell how it links; is the compiler not the usual one?")
    for order in range(orders):
        relink(lines[-1], BUILDS / f"{name}.{order}", order + 1)


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


def instructions(build, scene, *arguments):
    """Instructions per path, or nothing without valgrind. Sums are exact, so that two lengths are enough."""
    if not shutil.which("valgrind"):
        return None

    # A line asks for a millisecond, in which valgrind traces the 32 paths that come at once and no more.
    def traced(lines):
        command = ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null", BUILDS / f"{build}.0", "trace", scene]
        run = subprocess.run([*command, *arguments], cwd=ROOT, input="1\n" * lines, capture_output=True, text=True, check=True)
        return int(re.search(r"Collected : (\d+)", run.stderr)[1])

    return (traced(41) - traced(1)) / (40 * 32)


def start(effect, rounds):
    """Ratio of the times from start to end, whole over lacking, with interval: the scene is made ready, nothing is traced."""

    def once(name):
        before = time.perf_counter()
        subprocess.run([BUILDS / f"{name}.0", "trace", "scenes/cornell.xml"], cwd=ROOT, input="", text=True, check=True)
        return math.log(time.perf_counter() - before)

    times = [[once(name) for name in (("whole", effect), (effect, "whole"))[i % 2]] for i in range(rounds)]
    return interval(sorted((a - b) * (1, -1)[i % 2] for i, (a, b) in enumerate(times))[rounds // 8 : rounds - rounds // 8])


def price(effect, scene):
    """The share of tracing time that is saved without the effect, as the program says itself."""
    command = [ROOT / "target/release/pointillist", "explain", f"scenes/{scene}.xml", "--size", "128x128", "--device", "cpu", "--json"]
    out = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True)
    entries = json.loads(out.stdout)["plan"]
    found = next(e for e in entries if e["effect"] == effect and e["side"] == "tracer")
    return f"{scene}: {100 * found['share']:.1f} %" if found.get("share") is not None else ""


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("effects", nargs="*", choices=[[], *TRACER, "display"], help="which effects (all)")
    parser.add_argument("--orders", type=int, default=12, help="random orders of the functions, at least 2")
    parser.add_argument("--rounds", type=int, default=24, help="turns of each pair, at least 1")
    parser.add_argument("--keep-builds", action="store_true", help="use the builds of the last run")
    arguments = parser.parse_args()
    if arguments.orders < 2 or arguments.rounds < 1:
        parser.error("--orders must be at least 2, --rounds at least 1")
    effects = arguments.effects or [*TRACER, "display"]
    tracer, client = [e for e in TRACER if e in effects], "display" in effects
    if not arguments.keep_builds:
        for effect in [*tracer, *(["whole"] if tracer else [])]:
            build(effect, arguments.orders, False)
        for name in ("client", "whole-client") if client else ():
            build(name, 0, True)
        subprocess.run(["cargo", "build", "--release", "--locked", "--quiet", "--bin", "pointillist"], cwd=ROOT, check=True)
    missed = []

    def row(effect, what, logs, rest=""):
        mean, low, high = interval(logs)
        below = high < 1.0 and low < 0.99
        if below:
            missed.append(effect)
        print(f"{effect:<14} {what:<16} {mean:.4f} [{low:.4f}, {high:.4f}]  {rest}{'  BELOW' if below else ''}", flush=True)

    print(f"{'off':<14} {'scene without':<16} {'whole / lacking':<24}  instructions per path; start; price where it is on")
    for effect in tracer:
        without, with_it = TRACER[effect]
        scene = f"scenes/{without}.xml"
        pairs = [[Worker(b, i, "trace", scene) for b in ("whole", effect)] for i in range(arguments.orders)]
        logs = ratios(pairs, arguments.rounds, 20)
        counts = [instructions(b, scene) for b in ("whole", effect)]
        words = f"{counts[0]:.0f} / {counts[1]:.0f}" if None not in counts else ""
        begins = "start {:.3f} [{:.3f}, {:.3f}]".format(*start(effect, 40))
        row(effect, without, logs, f"{words:<15}  {begins}  {price(effect, with_it) if with_it else ''}")
    if client:
        pairs = [[Worker(b, 0, "paint") for b in ("whole-client", "client")] for _ in range(6)]
        row("display", "512x512, paint", ratios(pairs, arguments.rounds, 100), f"without {CLIENT}")
    if tracer:
        print(f"\n{'special code':<31} as planned / everything")
        for name, *how in PLANNED:
            scene, both = f"scenes/{name}.xml", (how, [*how, "everything"])
            orders = range(arguments.orders)
            pairs = [[Worker("whole", i, "trace", scene, *words) for words in both] for i in orders]
            mean, low, high = interval(ratios(pairs, arguments.rounds, 20))
            # A bidirectional index is more than a path, and takes longer than valgrind's millisecond.
            counts = [instructions("whole", scene, *words) for words in both] if not how else [None]
            words = f"{counts[0]:.0f} / {counts[1]:.0f}" if None not in counts else ""
            print(f"{' '.join([name, *how]):<31} {mean:.4f} [{low:.4f}, {high:.4f}]  {words}", flush=True)
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
