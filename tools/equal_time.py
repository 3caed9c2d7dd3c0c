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
WEIGHTS = np.array([0.2126, 0.7152, 0.0722])


def rel_mse(images):
    """Of the three channels together, and of luminance alone."""
    images = np.stack(images)
    luminance = images @ WEIGHTS
    scale = luminance.mean(0) ** 2 + 0.01
    return (images.var(0, ddof=1) / scale[..., None]).mean(), (luminance.var(0, ddof=1) / scale).mean()


def ours(a, scene, spp, seed):
    with tempfile.TemporaryDirectory() as place:
        file = os.path.join(place, "a.exr")
        command = [os.path.join(a.root, "target/release/pointillist"), "render", scene, "-o", file]
        command += ["--filter", "box", "--spp", str(spp), "--seed", str(seed), "--device", "cpu", "--quiet"]
        command += ["--size", "x".join(map(str, a.size))]
        if a.integrator:
            command += ["--integrator", a.integrator]
        done = subprocess.run(command + ["--json", "-"], capture_output=True, text=True)
        if done.returncode != 0:
            sys.exit(f"equal_time: {' '.join(command)} failed:\n{done.stderr}")
        return main_layer(mi, file), json.loads(done.stdout)["seconds"]["trace"]


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
        seconds = sum(t for _, t in runs) / len(runs)
        error, of_y = rel_mse([pixels for pixels, _ in runs])
        rate = a.size[0] * a.size[1] * spp / seconds / 1e6
        scaled = seconds / a.seconds
        figures = f"{rate:>11.2f}{error:>10.5f}{error * scaled:>15.5f}{of_y * scaled:>10.5f}"
        print(f"{name:<36}{spp:>6}{seconds:>9.2f}{figures}", flush=True)
        mine = error * scaled if mine is None else mine
    return mine


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
    parser.add_argument("--bounds", action="store_true", help="the scenes with a bound; exit status 1 where ours is above")
    a = parser.parse_args()
    a.size = tuple(int(n) for n in a.size.split("x"))
    if not a.bounds:
        if not a.scene:
            parser.error("which scene?")
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
