"""Whether studies keep their budget and their word, scene by scene: what tools/study_check runs.

Each scene is studied; then the recommended method and the runner-up render it for long. The time at which such a render comes down
to 5 % and 1 % is compared with the interval that the study gave. A render that does not get there within its time is carried on by
the slope of its error; such times are marked by ~.

A machine that others use, too, is slower at one time than at another: times of long renders are those of their paths at the speed
that the study measured, so that what is checked is the error and not the machine.
"""

import argparse
import json
import math
import os
import re
import subprocess
import sys
import time

PROGRAM = os.path.join(os.environ.get("CARGO_TARGET_DIR", "target"), "release", "pointillist")
TARGETS = (0.05, 0.01)
IN_TIME = 1.1  # A study may take so many times its budget.


def study(scene, folder, budget, options):
    """Runs a study. Returns its JSON and the seconds that it took."""
    start = time.monotonic()
    command = [PROGRAM, "study", scene, "--budget", str(budget), "-o", folder, *options]
    done = subprocess.run(command, capture_output=True, text=True)
    seconds = time.monotonic() - start
    if done.returncode != 0:
        sys.exit(f"{scene}: {done.stderr}")
    with open(os.path.join(folder, "study.json")) as file:
        return json.load(file), seconds, done.stdout


def long_render(scene, method, seconds, folder, options):
    """The curve of a long render: seconds, paths, error of 95 % of the picture."""
    report = os.path.join(folder, f"long-{method}.json")
    picture = os.path.join(folder, f"long-{method}.png")
    command = [PROGRAM, "render", scene, "--integrator", method, "--seed", "77", "--time", str(seconds)]
    command += ["--error", f"{100 * TARGETS[-1]}%", "-o", picture, "--json", report, "--quiet", *options]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{scene}, {method}: {done.stderr}")
    with open(report) as file:
        return json.load(file)["error"]["curve"]


def crossing(curve, target):
    """Paths at which a curve comes down to an error, and whether it does."""
    for (_, before, above), (_, after, below) in zip(curve, curve[1:]):
        if above > target >= below:
            share = math.log(above / target) / math.log(above / below)
            return before * (after / before) ** share, True
    if curve and curve[0][2] <= target:
        return curve[0][1], False
    # The slope over the last factor of four of paths.
    last = curve[-1]
    early = min(curve, key=lambda point: abs(math.log(4 * point[1] / last[1])))
    slope = math.log(early[2] / last[2]) / math.log(last[1] / early[1]) if early is not last else 0.5
    return last[1] * (last[2] / target) ** (1 / min(max(slope, 0.3), 0.8)), False


def check(scene, arguments, options):
    """Studies a scene and prints a line for each claim. Returns how many claims were checked, how many held, and whether it answered in time."""
    name = os.path.basename(os.path.dirname(scene)) if scene.endswith("/scene.xml") else os.path.basename(scene)[:-4]
    folder = os.path.join(arguments.output, name)
    os.makedirs(folder, exist_ok=True)
    told, seconds, text = study(scene, folder, arguments.budget, options)
    lines = text.splitlines()
    print(f"{name}: {seconds:.0f} s; {lines[1] if len(lines) > 1 else 'no answer'}", flush=True)
    for line in lines:
        if "brightness is" in line:
            print(f"    alarm: {line}")
    own = [method for method in told["methods"] if not method["peer"]]
    named = re.search(r"^Use (\w+):", text, re.MULTILINE)
    # The method that the study names, and the fastest of the others.
    ranked = sorted(own, key=lambda m: (named is None or m["name"] != named[1], rank(m)))
    checked, held, reached = 0, 0, {}
    for method in ranked[:2]:
        points = [p for p in method["points"] if p["seconds"] > 0.5]
        if not points:
            continue
        curve = long_render(scene, method["name"], arguments.long, folder, options)
        # Paths per second of the study, over the renders that its own times rest on.
        pixels = told["size"][0] * told["size"][1]
        points = [p for p in points if p["seconds"] >= 0.1 * points[-1]["seconds"]]
        rate = sum(p["samples_per_pixel"] * p["runs"] for p in points) * pixels / sum(p["seconds"] * p["runs"] for p in points)
        for target in TARGETS:
            price = next((p for p in method["prices"] if abs(p["error"] - target) < 1e-9), None)
            interval = price and price["seconds"]
            if not curve:
                continue
            paths, surely = crossing(curve, target)
            actual = paths / rate
            reached[method["name"], target] = actual
            said = "not known"
            if interval:
                said = f"{interval['value']:.1f} s ({interval['low']:.1f}–{interval['high']:.1f})"
                checked += 1
                inside = interval["low"] <= actual <= interval["high"]
                held += inside
                said += " held" if inside else " MISSED"
            print(f"    {method['name']} to {100 * target:g} %: {'' if surely else '~'}{actual:.1f} s; told {said}", flush=True)
    if len(ranked) > 1:
        first, second = ranked[0]["name"], ranked[1]["name"]
        if (first, 0.01) in reached and (second, 0.01) in reached:
            ratio = reached[first, 0.01] / min(reached[first, 0.01], reached[second, 0.01])
            print(f"    {first} takes {ratio:.2f} times as long as the better of the two")
    return checked, held, named is not None and seconds <= IN_TIME * arguments.budget


def rank(method):
    """The time to 1 %, or a long one."""
    price = next((p for p in method["prices"] if abs(p["error"] - 0.01) < 1e-9), None)
    return price["seconds"]["value"] if price and price["seconds"] else math.inf


def main():
    """Checks all scenes."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", metavar="SCENE.xml")
    parser.add_argument("--budget", type=int, default=120, help="seconds of each study (120)")
    parser.add_argument("--long", type=int, default=600, help="seconds of each long render, at most (600)")
    parser.add_argument("--size", help="size of the pictures, such as 384x384")
    parser.add_argument("-o", "--output", default="target/study_check", help="folder of the studies")
    arguments = parser.parse_args()
    scenes = arguments.scenes or [f"scenes/{name}" for name in sorted(os.listdir("scenes")) if name.endswith(".xml")]
    options = ["--size", arguments.size] if arguments.size else []
    checked = held = 0
    late = []
    for scene in scenes:
        more, good, in_time = check(scene, arguments, options)
        checked, held = checked + more, held + good
        if not in_time:
            late.append(scene)
    if checked:
        print(f"{held} of {checked} intervals held: {100 * held / checked:.0f} %")
    if late:
        sys.exit(f"no recommendation within {IN_TIME} of the budget: {', '.join(late)}")


main()
