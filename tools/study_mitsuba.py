"""Pictures of Mitsuba 3 (llvm_ad_spectral, path and ptracer) at the times of a study: wall-clock seconds, kernels compiled before.

The scene is that of the study, with a box filter. A picture of a time is the mean of passes until the time is over; each pass has
its own seed, and as many samples as a tenth of the shortest time allows.
"""

import os
import sys
import time

import mitsuba as mi
import numpy as np
from mitsuba_scene import load_box_filtered

TIMES = [1 / 3, 1.0, 3.0, 10.0, 30.0]
METHODS = ["path", "ptracer"]


def mean_after(render, seconds, seed):
    """The mean picture of passes that fill `seconds`, and the seconds that they took."""
    total, passes, start = 0.0, 0, time.perf_counter()
    while passes == 0 or time.perf_counter() - start < seconds:
        total = total + render(seed + passes)
        passes += 1
    return total / passes, time.perf_counter() - start


def main():
    path, size, folder, longest = sys.argv[1:]
    size = tuple(int(n) for n in size.split("x"))
    mi.set_variant("llvm_ad_spectral")
    scene = load_box_filtered(mi, path, {}, size)
    for name in METHODS:
        method = mi.load_dict({"type": name, "rr_depth": 5})
        render = lambda spp: lambda seed: np.array(mi.render(scene, integrator=method, spp=spp, seed=seed))[..., :3]
        render(1)(0)
        start = time.perf_counter()
        render(1)(1)
        spp = max(1, int(TIMES[0] / 10 / (time.perf_counter() - start)))
        render(spp)(2)
        for i, seconds in enumerate(t for t in TIMES if t <= float(longest)):
            picture, took = mean_after(render(spp), seconds, 1000 * (i + 1))
            file = os.path.join(folder, f"{name}-{seconds:.2f}.exr")
            mi.Bitmap(picture.astype(np.float32)).write(file)
            print(f"Mitsuba {mi.__version__} {name}={took:.3f}:{file}", flush=True)


if __name__ == "__main__":
    main()
