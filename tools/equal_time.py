"""Error at equal tracing time: Pointillist against Mitsuba 3's path tracer in its LLVM mode.

Both render the same file, box filter, in turn, with R seeds each. Both are unbiased, so the error of one rendering is
the variance between renderings; no reference is needed. relMSE = mean over pixels and channels of variance /
(Y^2 + 0.01), with Y the luminance of the mean; the last column is that of luminance alone. Time is processor time of the tracer threads (Pointillist) or of the
process (Mitsuba), so that other programs on the machine do not matter much; kernels are compiled before the clock
starts. The error at a wall time of t seconds on c cores is that of c*t processor seconds.
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

WEIGHTS = np.array([0.2126, 0.7152, 0.0722])


def rel_mse(images):
    """Of the three channels together, and of luminance alone."""
    images = np.stack(images)
    luminance = images @ WEIGHTS
    scale = luminance.mean(0) ** 2 + 0.01
    return (images.var(0, ddof=1) / scale[..., None]).mean(), (luminance.var(0, ddof=1) / scale).mean()


def ours(a, spp, seed):
    with tempfile.TemporaryDirectory() as place:
        file = os.path.join(place, "a.exr")
        command = [os.path.join(a.root, "target/release/pointillist"), "render", a.scene, "-o", file]
        command += ["--filter", "box", "--spp", str(spp), "--seed", str(seed), "--device", "cpu", "--quiet"]
        done = subprocess.run(command + ["--json", "-"], capture_output=True, text=True)
        if done.returncode != 0:
            sys.exit(f"equal_time: {' '.join(command)} failed:\n{done.stderr}")
        return main_layer(mi, file), json.loads(done.stdout)["seconds"]["trace"]


def theirs(scene, spp, seed):
    start = time.process_time()
    pixels = np.array(mi.render(scene, spp=spp, seed=seed))[..., :3].astype(np.float64)
    return pixels, time.process_time() - start


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene")
    parser.add_argument("--root", help=argparse.SUPPRESS)
    parser.add_argument("--seconds", type=float, default=20.0, help="processor seconds of one rendering (10 s on 2 cores)")
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--variants", nargs="+", default=["llvm_ad_spectral", "llvm_ad_rgb"])
    a = parser.parse_args()
    print(f"{a.scene}: {a.seeds} seeds, {a.seconds:g} processor seconds")
    print(f"{'renderer':<28}{'spp':>6}{'seconds':>9}{'M paths/s':>11}{'relMSE':>10}{'at equal time':>15}{'of Y':>10}")
    renderers = [("pointillist", None)] + [(f"mitsuba {v}", v) for v in a.variants]
    for name, variant in renderers:
        mi.set_variant(variant or "scalar_rgb")
        scene = load_box_filtered(mi, a.scene, {}, None)
        size = scene.sensors()[0].film().crop_size()
        render = (lambda spp, seed: theirs(scene, spp, seed)) if variant else (lambda spp, seed: ours(a, spp, seed))
        render(8, 1000)
        probe = render(8, 1001)[1] / 8
        spp = max(1, round(a.seconds / probe))
        runs = [render(spp, seed) for seed in range(a.seeds)]
        seconds = sum(t for _, t in runs) / len(runs)
        error, of_y = rel_mse([pixels for pixels, _ in runs])
        rate = size[0] * size[1] * spp / seconds / 1e6
        scaled = seconds / a.seconds
        figures = f"{rate:>11.2f}{error:>10.5f}{error * scaled:>15.5f}{of_y * scaled:>10.5f}"
        print(f"{name:<28}{spp:>6}{seconds:>9.2f}{figures}", flush=True)


if __name__ == "__main__":
    main()
