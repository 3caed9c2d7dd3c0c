"""What an effect costs that is off: the whole program against builds that lack one effect, on a scene without it, in turn.

For each effect: a build with POINTILLIST_WITHOUT=effect, in which its code is not there at all; then a scene that does not call for
the effect is rendered by both in turn, and the ratio (whole / lacking) of paths per second of tracing is printed with its 95 %
interval (Student's t over the logarithms of the pairs). 1 is what is wanted. The last column is the price of the effect in a scene
that has it, as `pointillist explain` measures it.
"""

import argparse
import json
import math
import os
import shutil
import statistics
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
BUILDS = ROOT / "target" / "effects"

# Effect: a scene without it, arguments; a scene with it, arguments.
EFFECTS = {
    "dispersion": (("cornell_spheres", []), ("prism", [])),
    "transmission": (("veach_plates", []), ("cornell_spheres", [])),
    "deltas": (("cornell", []), ("cornell_spheres", [])),
    "glossy": (("cornell_spheres", []), ("veach_plates", [])),
    "environment": (("cornell", []), ("rough", [])),
    "light-choice": (("cornell", []), ("veach_plates", [])),
    "lens": (("cornell", []), ("cornell", [])),
}

# Two-sided 95 % quantiles of Student's t by degrees of freedom; beyond the list that of the normal distribution is near.
T95 = [12.71, 4.30, 3.18, 2.78, 2.57, 2.45, 2.36, 2.31, 2.26, 2.23, 2.20, 2.18, 2.16, 2.14, 2.13, 2.12, 2.11, 2.10, 2.09]


def build(name, without):
    """A copy of the program, without an effect or whole."""
    env = {k: v for k, v in os.environ.items() if k != "POINTILLIST_WITHOUT"}
    if without:
        env["POINTILLIST_WITHOUT"] = without
    subprocess.run(["cargo", "build", "--release", "--locked", "--quiet", "--bin", "pointillist"], cwd=ROOT, env=env, check=True)
    BUILDS.mkdir(parents=True, exist_ok=True)
    shutil.copy2(ROOT / "target" / "release" / "pointillist", BUILDS / name)


def speed(name, scene, arguments):
    """Paths per second of tracing, one thread."""
    command = [BUILDS / name, "render", f"scenes/{scene}.xml", "-o", BUILDS / "out.png", "--json", "-", "-q", *arguments]
    command += ["--device", "cpu", "--threads", "1", "--size", "128x128", "--spp", "64"]
    out = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True)
    return json.loads(out.stdout)["paths_per_trace_second"]


def ratio(effect, scene, arguments, rounds):
    """Ratio and half width of its interval, both as factors of 1."""
    logs = []
    for i in range(rounds):
        pair = [("whole", 1), (effect, -1)]
        pair = pair if i % 2 == 0 else pair[::-1]
        logs.append(sum(sign * math.log(speed(name, scene, arguments)) for name, sign in pair))
    mean = statistics.fmean(logs)
    t = T95[rounds - 2] if rounds - 2 < len(T95) else 1.96
    return math.exp(mean), t * statistics.stdev(logs) / math.sqrt(rounds)


def price(effect, scene, arguments):
    """The share of tracing time that is saved without the effect, as the program says itself."""
    command = [BUILDS / "whole", "explain", f"scenes/{scene}.xml", "--size", "128x128", "--device", "cpu", "--json", *arguments]
    out = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True)
    entries = json.loads(out.stdout)["plan"]
    found = next(e for e in entries if e["effect"] == effect and e["side"] == "tracer")
    return f"{100 * found['share']:.1f} %" if found["on"] and found.get("share") is not None else "not priced"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("effects", nargs="*", choices=[[], *EFFECTS], help="which effects (all)")
    parser.add_argument("--rounds", type=int, default=12, help="pairs of runs per effect, at least 2")
    parser.add_argument("--keep-builds", action="store_true", help="use the builds of the last run")
    arguments = parser.parse_args()
    if arguments.rounds < 2:
        parser.error("--rounds must be at least 2")
    effects = arguments.effects or list(EFFECTS)
    if not arguments.keep_builds:
        for effect in effects:
            print(f"building without {effect}", file=sys.stderr)
            build(effect, effect)
        build("whole", None)
    print(f"{'effect':<14} {'scene without':<16} {'whole / lacking':<22} price in a scene with it")
    missed = []
    for effect in effects:
        without, with_it = EFFECTS[effect]
        mean, half = ratio(effect, *without, arguments.rounds)
        low, high = mean * math.exp(-half), mean * math.exp(half)
        ok = high >= 1.0 or low >= 0.99
        if not ok:
            missed.append(effect)
        verdict = "" if ok else "  BELOW"
        print(f"{effect:<14} {without[0]:<16} {mean:.4f} [{low:.4f}, {high:.4f}] {with_it[0]}: {price(effect, *with_it)}{verdict}", flush=True)
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
