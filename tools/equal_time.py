"""Error at equal tracing time: Pointillist against Mitsuba 3's path tracer in its LLVM mode.

Both render the same file, box filter, in turn, with R seeds each. Both are unbiased, so the error of one rendering is
the variance between renderings; no reference is needed. relMSE = mean over pixels and channels of variance /
(Y^2 + 0.01), with Y the luminance of the mean; the last column is that of luminance alone. Time is processor time of the tracer threads (Pointillist) or of the
process (Mitsuba), so that other programs on the machine do not matter much; kernels are compiled before the clock
starts. The error at a wall time of t seconds on c cores is that of c*t processor seconds.

--bounds compares every method of ours with Mitsuba's best on ten kinds of scenes, after 1 and 10 s on 2 cores, and fails
where the ratio of errors is above its bound:
  scenes/cornell.xml          0.6              diffuse
  scenes/cornell_spheres.xml  0.25             a mirror ball and a glass ball of index 1.5; 0.15 by photon mapping
  scenes/cove.xml             0.4              lit from a hidden ledge; also against Mitsuba's ptracer
  scenes/veach_door.xml       0.4              lit through a door ajar; also against Mitsuba's ptracer
  scenes/veach_plates.xml     0.5              four rough metals, four lights of equal power
  target/meshes/bigmesh.xml   0.5              a landscape of 1.6 million triangles under a sky and a lamp, made on first use
  target/cornell_fog.xml      0.5              the first one full of fog; it and the next ones against Mitsuba's volpathmis
  scenes/smoke.xml            0.6              a plume of smoke on a grid under a sky
  scenes/milk.xml             0.6              a tumbler of milk
  scenes/fog.xml              0.5              a caustic in fog; 0.1 by vcm
The bound is for the best unbiased method at either time, and for photon mapping where it has a bound of its own. --seconds (20) are the
processor seconds of the longer time at 512 x 512: they are scaled by the number of pixels, so that --size 128x128 is a quick try
with the same paths per pixel.
  The reference is the mean of our unbiased methods' longer pictures, weighted by the inverse of their errors. Its luminance is the
denominator of every error, Mitsuba's included: relative to the mean of its own few pictures, a firefly would hide itself. Noise is
the variance between seeds, which needs no reference, so that spectral pictures are never compared with RGB ones. To the noise
of photon mapping its bias is added: the squared difference of its mean from the reference, less the variance of that
difference. A method that misses light (see --methods) is marked and counts neither for the reference nor for the bound.
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
import re
import subprocess
import sys
import tempfile
import time

import mitsuba as mi
import numpy as np
from mitsuba_scene import load_box_filtered, main_layer

# The Cornell box full of fog. Its boundary keeps away from the lamp: Mitsuba loses light where they are near each other.
FOGGED = "target/cornell_fog.xml"
FOG = '''
  <medium type="homogeneous" id="fog">
    <float name="sigma_t" value="0.1"/>
    <rgb name="albedo" value="0.9, 0.9, 0.92"/>
    <phase type="hg">
      <float name="g" value="0.5"/>
    </phase>
  </medium>
  <shape type="cube">
    <transform name="to_world">
      <scale x="3" y="3.05" z="3"/>
      <translate y="2.75"/>
    </transform>
    <bsdf type="null"/>
    <ref name="interior" id="fog"/>
  </shape>
</scene>
'''
# Scene, bound of the ratio to Mitsuba's error for our best unbiased method, the same for other methods, and Mitsuba's peers.
LANDSCAPE = "target/meshes/bigmesh.xml"
BOUNDS = [
    ("scenes/cornell.xml", 0.6, {}, ["path"]),
    ("scenes/cornell_spheres.xml", 0.25, {"photon": 0.15, "vcm": 0.15}, ["path"]),
    ("scenes/cove.xml", 0.4, {}, ["path", "ptracer"]),
    ("scenes/veach_door.xml", 0.4, {}, ["path", "ptracer"]),
    ("scenes/veach_plates.xml", 0.5, {}, ["path"]),
    (LANDSCAPE, 0.5, {}, ["path"]),
    (FOGGED, 0.5, {}, ["volpathmis"]),
    ("scenes/smoke.xml", 0.6, {}, ["volpathmis"]),
    ("scenes/milk.xml", 0.6, {}, ["volpathmis"]),
    ("scenes/fog.xml", 0.5, {"vcm": 0.1}, ["volpathmis"]),
]
# The peers' variant, and the times as shares of --seconds, the longest first: its pictures are the reference.
BOUND_VARIANT, TIMES = "llvm_ad_rgb", [1.0, 0.1]
# The pixels that --seconds are for.
PIXELS = 512 * 512
# All of ours; the last one chooses among the others.
METHODS = ["path", "light", "bidirectional", "photon", "vcm", "auto"]
# Those of them that blur.
BIASED = ("photon", "vcm")
# Light that a method may miss, and the standard errors that show it does.
MISSED, CERTAIN = 0.02, 4.0
WEIGHTS = np.array([0.2126, 0.7152, 0.0722])


def rel_mse(images, brightness=None):
    """Of the three channels together, and of luminance alone; relative to `brightness`, or to the mean of the images."""
    images = np.stack(images)
    luminance = images @ WEIGHTS
    scale = (luminance.mean(0) if brightness is None else brightness) ** 2 + 0.01
    return (images.var(0, ddof=1) / scale[..., None]).mean(), (luminance.var(0, ddof=1) / scale).mean()


def light_of(images):
    """Mean luminance of pictures of different seeds, and its standard error."""
    luminance = np.stack(images) @ WEIGHTS
    means = luminance.mean((1, 2))
    # The variance of two numbers is often far too small: that of the pixels, were they independent, is the least that is believed.
    independent = luminance.var(0, ddof=1).mean() / luminance[0].size
    return means.mean(), (max(means.var(ddof=1), independent) / len(means)) ** 0.5


def ours(a, scene, spp, seed, method=None):
    """Pixels, tracing seconds, and the program's figures."""
    with tempfile.TemporaryDirectory() as place:
        file = os.path.join(place, "a.exr")
        command = [a.program or os.path.join(a.root, "target/release/pointillist"), "render", scene, "-o", file]
        command += ["--filter", "box", "--spp", str(spp), "--seed", str(seed), "--device", "cpu", "--quiet"]
        command += ["--size", "x".join(map(str, a.size))]
        if method or a.integrator:
            command += ["--integrator", method or a.integrator]
        done = subprocess.run(command + ["--json", "-"], capture_output=True, text=True)
        if done.returncode != 0:
            sys.exit(f"equal_time: {' '.join(command)} failed:\n{done.stderr}")
        figures = json.loads(done.stdout)
        return main_layer(mi, file), figures["seconds"]["trace"], figures


def peer_of(path, peer):
    """An integrator of Mitsuba that follows paths as far as the file says."""
    with open(path) as file:
        depth = re.search(r'default name="max_depth" value="(-?[0-9]+)"', file.read())
    return mi.load_dict({"type": peer, "rr_depth": 5, "max_depth": int(depth[1]) if depth else -1})


def write_fogged(root):
    """The Cornell box full of fog."""
    with open(os.path.join(root, "scenes/cornell.xml")) as file:
        text = file.read()
    text = text.replace('<integrator type="path">', '<integrator type="volpath">')
    text = text.replace("</scene>", FOG)
    with open(os.path.join(root, FOGGED), "w") as file:
        file.write(text)


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
            scene, method = load_box_filtered(mi, path, {}, a.size), peer_of(path, peer)
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
        rows[method] = [spps[method], seconds, error, of_y, *light_of([run[0] for run in runs[method]])]
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


class Timed:
    """Pictures of one renderer at one time, one for each seed, and what they say: mean, variance, luminance."""

    def __init__(self, name, render, seconds, seeds):
        # The first rendering compiles kernels.
        render(1, 1000)
        probe = render(4, 1001)
        spp = max(1, round(4 * seconds / probe[1]))
        runs = [render(spp, seed) for seed in range(seeds)]
        images = np.stack([run[0] for run in runs])
        spent = sum(run[1] for run in runs) / seeds
        self.name, self.spp, self.seconds, self.seeds = name, spp, spent, seeds
        self.chosen = probe[2]["integrator"] if name == "auto" else name
        self.mean, self.variance, self.scale = images.mean(0), images.var(0, ddof=1), spent / seconds
        self.light, self.uncertainty = light_of(images)

    def below(self, other):
        """True if this shows significantly less light than `other`."""
        certain = CERTAIN * np.hypot(self.uncertainty, other.uncertainty)
        return other.light - self.light > max(MISSED * other.light, certain)

    def error(self, reference):
        """Noise at equal time, and squared bias if the method is biased, relative to the luminance of `reference`."""
        mean, variance = reference
        brightness = ((mean @ WEIGHTS) ** 2 + 0.01)[..., None]
        noise = (self.variance / brightness).mean() * self.scale
        if self.chosen not in BIASED:
            return noise, 0.0
        own = (self.mean - mean) ** 2 - self.variance / self.seeds - variance
        return noise, max(0.0, (own / brightness).mean())


def joined(methods):
    """The mean of unbiased methods, weighted by the inverse of their errors, and the variance of that mean."""
    if not methods:
        sys.exit("equal_time: every unbiased method misses light here: take more --seeds or a larger --size")
    plain = sum(m.mean for m in methods) / len(methods)
    brightness = ((plain @ WEIGHTS) ** 2 + 0.01)[..., None]
    weights = np.array([1 / max((m.variance / brightness).mean(), 1e-12) for m in methods])
    weights /= weights.sum()
    mean = sum(w * m.mean for w, m in zip(weights, methods))
    return mean, sum(w**2 * m.variance / m.seeds for w, m in zip(weights, methods))


def timed(a, path, peers, share):
    """All of ours, and the peers, at one share of --seconds."""
    seconds = a.seconds * share * a.size[0] * a.size[1] / PIXELS
    mi.set_variant("scalar_rgb")
    mine = [Timed(m, lambda spp, seed, m=m: ours(a, path, spp, seed, m), seconds, a.seeds) for m in METHODS]
    mi.set_variant(BOUND_VARIANT)
    scene = load_box_filtered(mi, path, {}, a.size)
    others = []
    for peer in peers:
        method = peer_of(path, peer)
        render = lambda spp, seed, method=method: theirs(scene, method, spp, seed)
        others.append(Timed(f"mitsuba {peer}", render, seconds, a.seeds))
    return mine, others


def check_bounds(a, path, bound, special, peers):
    """Prints one row per method and time; returns how many bounds do not hold."""
    above, reference = 0, None
    for share in TIMES:
        mine, others = timed(a, path, peers, share)
        unbiased = [m for m in mine if m.name not in (*BIASED, "auto")]
        whole = [m for m in unbiased if not any(m.below(other) for other in unbiased)]
        reference = reference or joined(whole)
        errors = {m.name: m.error(reference) for m in [*mine, *others]}
        total = {name: sum(error) for name, error in errors.items()}
        theirs_best = min(total[m.name] for m in others)
        best = min(whole, key=lambda m: total[m.name])
        for m in [*mine, *others]:
            ratio, (_, bias) = total[m.name] / theirs_best, errors[m.name]
            limit = special.get(m.chosen, bound) if m in mine else None
            missing = m in unbiased and m not in whole or m.chosen in [w.name for w in unbiased if w not in whole]
            binding = m is best or m.name in special
            verdict = "" if limit is None else "misses light" if missing else "holds" if ratio <= limit else "ABOVE"
            above += binding and verdict == "ABOVE"
            name = m.name + (f" ({m.chosen})" if m.name == "auto" else "") + (" <" if binding else "")
            figures = f"{total[m.name]:>10.5f}{bias:>10.5f}{ratio:>8.2f}{limit or '':>7} {verdict}"
            print(f"{os.path.basename(path):<22}{a.seconds / 2 * share:>4g}{name:>24}{m.spp:>6}{m.seconds:>8.2f}{figures}", flush=True)
    return above


def bounds(a):
    """Compares all scenes with a bound; returns how many bounds do not hold."""
    head = f"{'scene':<22}{'s':>4}{'method':>24}{'spp':>6}{'cpu s':>8}{'error':>10}{'bias':>10}{'ratio':>8}{'bound':>7}"
    print(f"{a.size[0]} x {a.size[1]}, {a.seeds} seeds; error is relMSE at equal time, bias included; < has to hold")
    print(head, flush=True)
    scenes = [one for one in BOUNDS if not a.scene or a.scene in one[0]]
    if not scenes:
        sys.exit(f"equal_time: no scene with a bound is called {a.scene}")
    paths, landscape = [one[0] for one in scenes], os.path.join(a.root, LANDSCAPE)
    if FOGGED in paths:
        write_fogged(a.root)
    if LANDSCAPE in paths and not os.path.exists(landscape):
        make = ["cargo", "run", "--release", "--quiet", "--example", "make", "--", "meshes", os.path.dirname(landscape), "obj"]
        subprocess.run(make, cwd=a.root, check=True, stdout=subprocess.DEVNULL)
    return sum(check_bounds(a, os.path.join(a.root, path), *rest) for path, *rest in scenes)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", nargs="?", help="Mitsuba 3 scene file; with --bounds, part of the name of the only one to check")
    parser.add_argument("--root", default=".", help=argparse.SUPPRESS)
    parser.add_argument("--seconds", type=float, default=20.0, help="processor seconds of one rendering (10 s on 2 cores)")
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--size", default="512x512", help="of both pictures, WxH (512x512)")
    parser.add_argument("--integrator", metavar="NAME", help="of ours: handed on as it is (the program's own choice)")
    parser.add_argument("--peer", nargs="+", default=[], help="integrators of Mitsuba to measure beside path")
    parser.add_argument("--variants", nargs="+", default=["llvm_ad_spectral", "llvm_ad_rgb"])
    parser.add_argument("--methods", nargs="*", metavar="NAME", help="compare ours (all without names) instead of Mitsuba")
    parser.add_argument("--bounds", action="store_true", help="the scenes with a bound; exit status 1 where ours is above")
    parser.add_argument("--program", metavar="FILE", help="ours (target/release/pointillist)")
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
    sys.exit(1 if bounds(a) else 0)


if __name__ == "__main__":
    main()
