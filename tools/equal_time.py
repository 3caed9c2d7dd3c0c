"""Error at equal tracing time: Pointillist against Mitsuba 3's path tracer in its LLVM mode.

Both render the same file, box filter, in turn, with R seeds each. Both are unbiased, so the error of one rendering is
the variance between renderings; no reference is needed. relMSE = mean over pixels and channels of variance /
(Y^2 + 0.01), with Y the luminance of the mean; the last column is that of luminance alone. Time is processor time of the tracer threads (Pointillist) or of the
process (Mitsuba), so that other programs on the machine do not matter much; kernels are compiled before the clock
starts. The error at a wall time of t seconds on c cores is that of c*t processor seconds.

--bounds runs the scenes that have a bound at 10 s on 2 cores, with --integrator as given, and fails where ours is above:
  scenes/cove.xml             0.015   lit from a hidden ledge (a 5.5 m room)
  scenes/cornell_spheres.xml  0.025   a mirror ball and a glass ball of index 1.5
  scenes/veach_plates.xml     0.008   four rough metals, four lights of equal power
  scenes/cornell.xml          0.0019  diffuse
--methods runs all of ours on one scene, and `auto`, in turn, and prints the ratio of each to the best. Here Y is the median
of the methods' means of a pixel: relative to the mean of its own R pictures, a bright speck counts R at most,
however bright, and a method that shows a caustic as a few specks would look best. "of light" is mean luminance over the
greatest. A method whose trial in `auto` says that it cannot show all, or whose mean is below another's by over
2 % and 4 standard errors, is marked and does not count as the best.

Mitsuba's particle tracer is the better peer in the first (--peer ptracer adds it to any scene).
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time

import mitsuba as mi
import numpy as np
from compare_mitsuba import load_box_filtered, main_layer

# Scene, greatest relMSE of ours in 20 processor seconds at 512 x 512, and what else to measure of Mitsuba.
BOUNDS = [
    ("cove", 0.015, ["ptracer"]),
    ("cornell_spheres", 0.025, []),
    ("veach_plates", 0.008, []),
    ("cornell", 0.0019, []),
]
# All of ours; the last one chooses among the others.
METHODS = ["path", "light", "bidirectional", "photon", "auto"]
# Light that a method may miss, and the standard errors that show it does.
MISSED, CERTAIN = 0.02, 4.0
WEIGHTS = np.array([0.2126, 0.7152, 0.0722])


def rel_mse(images, brightness=None):
    """Of the three channels together, and of luminance alone; relative to `brightness`, or to the mean of the images."""
    images = np.stack(images)
    luminance = images @ WEIGHTS
    scale = (luminance.mean(0) if brightness is None else brightness) ** 2 + 0.01
    return (images.var(0, ddof=1) / scale[..., None]).mean(), (luminance.var(0, ddof=1) / scale).mean()


def ours(a, scene, spp, seed, method=None):
    """Pixels, tracing seconds, and the program's figures."""
    with tempfile.TemporaryDirectory() as place:
        file = os.path.join(place, "a.exr")
        command = [os.path.join(a.root, "target/release/pointillist"), "render", scene, "-o", file]
        command += ["--filter", "box", "--spp", str(spp), "--seed", str(seed), "--device", "cpu", "--quiet"]
        command += ["--size", "x".join(map(str, a.size))]
        if method or a.integrator:
            command += ["--integrator", method or a.integrator]
        done = subprocess.run(command + ["--json", "-"], capture_output=True, text=True)
        if done.returncode != 0:
            sys.exit(f"equal_time: {' '.join(command)} failed:\n{done.stderr}")
        figures = json.loads(done.stdout)
        return main_layer(mi, file), figures["seconds"]["trace"], figures


def theirs(scene, integrator, spp, seed):
    start = time.process_time()
    pixels = np.array(mi.render(scene, integrator=integrator, spp=spp, seed=seed))[..., :3].astype(np.float64)
    return pixels, time.process_time() - start


def measure(a, path, peers):
    """Prints one row per renderer; returns our relMSE at equal time."""
    print(f"{path}: {a.seeds} seeds, {a.seconds:g} processor seconds, {a.size[0]} x {a.size[1]}")
    print(f"{'renderer':<36}{'spp':>6}{'seconds':>9}{'M paths/s':>11}{'relMSE':>10}{'at equal time':>15}{'of Y':>10}")
    renderers = [("pointillist" + (f" {a.integrator}" if a.integrator else ""), None, None)]
    renderers += [(f"mitsuba {v} {p}", v, p) for v in a.variants for p in ["path", *peers]]
    mine = None
    for name, variant, peer in renderers:
        mi.set_variant(variant or "scalar_rgb")
        if variant:
            scene, method = load_box_filtered(mi, path, {}, a.size), mi.load_dict({"type": peer, "rr_depth": 5})
        render = (lambda spp, seed: theirs(scene, method, spp, seed)) if variant else (lambda *n: ours(a, path, *n))
        render(8, 1000)
        probe = render(8, 1001)[1] / 8
        spp = max(1, round(a.seconds / probe))
        runs = [render(spp, seed) for seed in range(a.seeds)]
        seconds = sum(run[1] for run in runs) / len(runs)
        error, of_y = rel_mse([run[0] for run in runs])
        rate = a.size[0] * a.size[1] * spp / seconds / 1e6
        scaled = seconds / a.seconds
        figures = f"{rate:>11.2f}{error:>10.5f}{error * scaled:>15.5f}{of_y * scaled:>10.5f}"
        print(f"{name:<36}{spp:>6}{seconds:>9.2f}{figures}", flush=True)
        mine = error * scaled if mine is None else mine
    return mine


def measure_methods(a, path):
    """Prints one row per method of ours; returns the error of `auto` over the least, at equal time."""
    mi.set_variant("scalar_rgb")
    print(f"{path}: {a.seeds} seeds, {a.seconds:g} processor seconds, {a.size[0]} x {a.size[1]}")
    print(f"{'method':<24}{'spp':>6}{'seconds':>9}{'relMSE at equal time':>22}{'of Y':>10}{'/ best':>9}{'of light':>10}")
    runs, spps = {method: [] for method in a.methods}, {}
    for method in a.methods:
        ours(a, path, 1, 1000, method)
        probe = ours(a, path, 8, 1001, method)
        spps[method] = max(1, round(a.seconds / (probe[1] / 8)))
        if method == "auto":
            reason, choosing, chosen = probe[2]["auto"]["reason"], probe[2]["seconds"]["choose"], probe[2]["integrator"]
            # A trial says that a method cannot show all there is; whoever is not tried is taken to show it.
            whole = {one["method"]: one["complete"] for one in probe[2]["auto"]["candidates"]}
    # In turn, so that what else goes on meets all alike.
    for seed in range(a.seeds):
        for method in a.methods:
            runs[method].append(ours(a, path, spps[method], seed, method))
    means = [np.mean([run[0] @ WEIGHTS for run in runs[method]], axis=0) for method in a.methods]
    median = np.median(means, axis=0)
    rows = {}
    for method in a.methods:
        seconds = sum(run[1] for run in runs[method]) / a.seeds
        error, of_y = (e * seconds / a.seconds for e in rel_mse([run[0] for run in runs[method]], median))
        means = np.array([(run[0] @ WEIGHTS).mean() for run in runs[method]])
        rows[method] = [spps[method], seconds, error, of_y, means.mean(), means.std(ddof=1) / a.seeds**0.5]
    most = max(row[4] for row in rows.values())
    below = lambda p, q: q[4] - p[4] > max(MISSED * q[4], CERTAIN * np.hypot(p[5], q[5]))
    partial = [m for m, row in rows.items() if any(below(row, other) for other in rows.values())]
    partial += [m for m in rows if "auto" in rows and not whole.get(m, True) and m not in partial]
    whole_ones = [row[2] for m, row in rows.items() if m not in partial and m != "auto"]
    best = min(whole_ones or [row[2] for row in rows.values()])
    for method, (spp, seconds, error, of_y, light, _) in rows.items():
        name = method + (f" ({chosen})" if method == "auto" else "") + (" *" if method in partial else "")
        print(f"{name:<24}{spp:>6}{seconds:>9.2f}{error:>22.5f}{of_y:>10.5f}{error / best:>9.2f}{light / most:>10.3f}")
    if partial:
        print("* does not show all of the light")
    if "auto" in rows:
        print(f"{reason} (chosen in {choosing * 1e3:.0f} ms)", flush=True)
        return rows["auto"][2] / best
    return None


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", nargs="?", help="Mitsuba 3 scene file (not needed with --bounds)")
    parser.add_argument("--root", help=argparse.SUPPRESS)
    parser.add_argument("--seconds", type=float, default=20.0, help="processor seconds of one rendering (10 s on 2 cores)")
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--size", default="512x512", help="of both pictures, WxH (512x512)")
    parser.add_argument("--integrator", metavar="NAME", help="of ours: handed on as it is (the program's own choice)")
    parser.add_argument("--peer", nargs="+", default=[], help="integrators of Mitsuba to measure beside path")
    parser.add_argument("--variants", nargs="+", default=["llvm_ad_spectral", "llvm_ad_rgb"])
    parser.add_argument("--methods", nargs="*", metavar="NAME", help="compare ours (all without names) instead of Mitsuba")
    parser.add_argument("--bounds", action="store_true", help="the scenes with a bound; exit status 1 where ours is above")
    a = parser.parse_args()
    a.size = tuple(int(n) for n in a.size.split("x"))
    if not a.bounds:
        if not a.scene:
            parser.error("which scene?")
        if a.methods is not None:
            a.methods = a.methods or METHODS
            measure_methods(a, a.scene)
            return
        measure(a, a.scene, a.peer)
        return
    above = 0
    for name, bound, peers in BOUNDS:
        error = measure(a, os.path.join(a.root or ".", f"scenes/{name}.xml"), [*peers, *a.peer])
        above += error > bound
        print(f"{name}: {error:.5f}, bound {bound:g}: {'ABOVE' if error > bound else 'holds'}\n", flush=True)
    sys.exit(1 if above else 0)


if __name__ == "__main__":
    main()
