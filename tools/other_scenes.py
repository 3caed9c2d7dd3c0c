"""Error at equal processor time in other people's scenes: every method of ours, and `auto`, beside Mitsuba 3's path tracer in its LLVM mode.

other_scenes PLACE...: scene files, and folders, which stand for every `*.xml` in them and `scene.xml` in their folders.

Both programs render each scene with box filter and --seeds seeds, all renderers in turn, seed by seed, so that what else the machine
does meets all of them. Times are processor seconds: of the tracer's threads (Pointillist), of the process (Mitsuba, whose kernels are
compiled before). --seconds are those on each of 2 cores for a picture of 256 pixels' width; a tenth of them is measured, too.

error     relMSE: mean over the pixels of the variance of luminance between seeds / (Y^2 + 0.01), at equal time. Y is the mean of our
          unbiased methods' longer pictures, weighted by the inverses of their errors. To methods that blur (photon, vcm) the squared
          difference of their mean from Y is added, less the variance of that difference.
ratio     to Mitsuba's error, with its 95 % interval from the errors of the seeds (Student's t).
*         misses light: its mean luminance is significantly below that of others.

The costs below each scene compare path tracing in both programs: paths per second of one core, vertices per path (for Mitsuba counted by
an integrator that scatters and ends paths by the rules of its `path`), nanoseconds per vertex, and the variance of one path per pixel.

The last lines are the worst ratio and the geometric mean of `auto` over all scenes. The exit status is 1 where after --seconds a ratio is
above 1 or the mean above 0.65, or where after a tenth of that a ratio is above 1.2.
"""

import argparse
import json
import os
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import drjit as dr
import mitsuba as mi
import numpy as np
from mitsuba_scene import load_box_filtered
from equal_time import BIASED, CERTAIN, METHODS, MISSED, WEIGHTS, light_of, ours, theirs

VARIANT, PEER = "llvm_ad_rgb", "mitsuba path"
# Mitsuba's default, and that of the scenes that say nothing.
RR_DEPTH = 5
CORES = 2
# The times as shares of --seconds, the longest first, whose pictures are the reference; and the largest ratio of `auto` at each.
TIMES = [(1.0, 1.0), (0.1, 1.2)]
LARGEST_MEAN = 0.65
# Two-sided 95 % quantiles of Student's t by degrees of freedom.
STUDENT = {3: 3.182, 4: 2.776, 5: 2.571, 6: 2.447, 7: 2.365, 8: 2.306, 9: 2.262, 11: 2.201, 15: 2.131}


def depth_of(path):
    """The longest path that the scene file asks for, in segments; -1 for any length."""
    root = ElementTree.parse(path).getroot()
    defaults = {f"${one.get('name')}": one.get("value") for one in root.iter("default")}
    for one in root.iter("integrator"):
        for number in one.iter("integer"):
            if number.get("name") in ("max_depth", "maxDepth"):
                value = number.get("value")
                try:
                    return int(defaults.get(value, value))
                except ValueError:
                    sys.exit(f"other_scenes: {path}: {number.get('name')} is {value}, which is no number here")
    return -1


def scenes(places):
    """The scene files that the places stand for."""
    found = []
    for place in map(Path, places):
        if place.is_dir():
            files = sorted([*place.glob("*.xml"), *place.glob("*/scene.xml")])
            if not files:
                sys.exit(f"other_scenes: {place} holds neither *.xml nor */scene.xml")
            found += files
        elif place.is_file():
            found.append(place)
        else:
            sys.exit(f"other_scenes: there is no file {place}")
    return found


class Renderer:
    """Pictures of one renderer at one time, one for each seed."""

    def __init__(self, name, render, seconds):
        self.name, self.render, self.seconds = name, render, seconds
        # The first rendering compiles kernels.
        render(1, 1000)
        probe = render(4, 1001)
        self.spp = max(1, round(4 * seconds / probe[1]))
        self.chosen = probe[2]["integrator"] if name == "auto" else name
        self.runs = []

    def take(self, seed):
        pixels, seconds = self.render(self.spp, seed)[:2]
        self.runs.append((pixels @ WEIGHTS, seconds))

    def finish(self):
        images = np.stack([run[0] for run in self.runs])
        self.seeds = len(images)
        self.images, self.mean, self.variance = images, images.mean(0), images.var(0, ddof=1)
        self.spent = np.mean([run[1] for run in self.runs])
        self.scale = self.spent / self.seconds
        self.light, self.uncertainty = light_of([np.repeat(image[..., None], 3, -1) for image in images])

    def below(self, other):
        """True if this shows significantly less light than `other`."""
        certain = CERTAIN * np.hypot(self.uncertainty, other.uncertainty)
        return other.light - self.light > max(MISSED * other.light, certain)

    def errors(self, reference):
        """An estimate of the error at equal time from each seed, of which each has the error as its expectation."""
        mean, variance = reference
        brightness = mean**2 + 0.01
        noise = ((self.images - self.mean) ** 2 / brightness).mean((1, 2)) * self.seeds / (self.seeds - 1)
        bias = 0.0
        if self.chosen in BIASED:
            own = (self.mean - mean) ** 2 - self.variance / self.seeds - variance
            bias = max(0.0, (own / brightness).mean())
        return noise * self.scale + bias


def reference_of(renderers):
    """Mean luminance of unbiased methods, weighted by the inverses of their errors, and its variance."""
    plain = sum(r.mean for r in renderers) / len(renderers)
    weights = np.array([1 / max((r.variance / (plain**2 + 0.01)).mean(), 1e-12) for r in renderers])
    weights /= weights.sum()
    mean = sum(w * r.mean for w, r in zip(weights, renderers))
    return mean, sum(w**2 * r.variance / r.seeds for w, r in zip(weights, renderers))


def ratio(errors, others):
    """The ratio of the means, and the ends of its interval."""
    relative = [np.std(e, ddof=1) / (np.mean(e) * len(e) ** 0.5) for e in (errors, others)]
    freedom = len(errors) - 1
    t = STUDENT.get(freedom) or min((k, v) for k, v in STUDENT.items() if k >= min(freedom, 15))[1]
    spread = np.exp(t * np.hypot(*relative))
    middle = np.mean(errors) / np.mean(others)
    return middle, middle / spread, middle * spread


def vertices_of_mitsuba(scene, depth):
    """Vertices per path of Mitsuba's `path` with paths of at most `depth` segments (-1 for any length): an integrator that scatters and
    ends paths as that does, and returns their number."""

    class VertexCounter(mi.SamplingIntegrator):
        def sample(self, scene, sampler, ray, medium=None, active=True):
            longest = mi.UInt32(depth if depth >= 0 else 2**31 - 1)

            @dr.syntax
            def walk(scene, sampler, ray, active, longest):
                count, throughput, eta = mi.UInt32(0), mi.Spectrum(1), mi.Float(1)
                while active:
                    si = scene.ray_intersect(ray, active)
                    active &= si.is_valid()
                    count[active] += 1
                    active &= count < longest
                    bsdf = si.bsdf(ray)
                    sample, weight = bsdf.sample(mi.BSDFContext(), si, sampler.next_1d(active), sampler.next_2d(active), active)
                    throughput *= weight
                    eta *= sample.eta
                    ray = si.spawn_ray(si.to_world(sample.wo))
                    largest = dr.max(throughput)
                    survival = dr.minimum(largest * dr.square(eta), 0.95)
                    armed = count >= RR_DEPTH
                    throughput[armed] *= dr.rcp(survival)
                    active &= (~armed | (sampler.next_1d(active) < survival)) & (largest > 0)
                # Ours does not count the last vertex, which no path is scattered at, either.
                return dr.minimum(count, longest - 1)

            return mi.Spectrum(mi.Float(walk(scene, sampler, mi.Ray3f(ray), mi.Bool(active), longest))), mi.Bool(True), []

    mi.register_integrator("vertex_counter", lambda props: VertexCounter(props))
    return float(np.array(mi.render(scene, integrator=mi.load_dict({"type": "vertex_counter"}), spp=16))[..., 0].mean())


def print_costs(a, path, size, scene, mine, peer, reference):
    """Costs of path tracing in both programs."""
    command = [os.path.join(a.root, "target/release/examples/benchmarks"), "vertices", path, "--size", *map(str, size)]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"other_scenes: {' '.join(command)} failed:\n{done.stderr}")
    vertices = {mine.name: json.loads(done.stdout)["vertices"], peer.name: vertices_of_mitsuba(scene, depth_of(path))}
    print(f"  {'':<16}{'paths/s':>10}{'vertices':>10}{'ns/vertex':>11}{'variance/path':>15}")
    for one in (mine, peer):
        rate = size[0] * size[1] * one.spp / one.spent
        variance = one.errors(reference).mean() / one.scale * one.spp
        count = vertices[one.name]
        print(f"  {one.name:<16}{rate:>10.0f}{count:>10.2f}{1e9 / (rate * count):>11.0f}{variance:>15.3f}")


def measure(a, path):
    """Prints one row per renderer and time; returns the ratios of `auto`, one for each time."""
    mi.set_variant(VARIANT)
    width, height = load_box_filtered(mi, path, {}, None, "path").sensors()[0].film().size()
    size, ratios, reference = [a.width, max(1, round(a.width * height / width))], [], None
    a.size, a.integrator = size, None
    scene = load_box_filtered(mi, path, {}, size, "path")
    method = mi.load_dict({"type": "path", "rr_depth": RR_DEPTH, "max_depth": depth_of(path)})
    for share, bound in TIMES:
        seconds = a.seconds * CORES * share
        all_ours = [Renderer(m, lambda spp, seed, m=m: ours(a, path, spp, seed, m), seconds) for m in a.methods]
        peer = Renderer(PEER, lambda spp, seed: theirs(scene, method, spp, seed), seconds)
        for seed in range(a.seeds):
            for one in [*all_ours, peer]:
                one.take(seed)
        for one in [*all_ours, peer]:
            one.finish()
        unbiased = [one for one in all_ours if one.name not in (*BIASED, "auto")]
        whole = [one for one in unbiased if not any(one.below(other) for other in unbiased)]
        if not whole:
            sys.exit(f"other_scenes: every unbiased method misses light in {path}: take more --seeds or --seconds")
        reference = reference or reference_of(whole)
        theirs_errors = peer.errors(reference)
        for one in [*all_ours, peer]:
            errors = one.errors(reference)
            middle, low, high = ratio(errors, theirs_errors)
            missing = one.name in METHODS and any(one.below(other) for other in unbiased)
            name = one.name + (f" ({one.chosen})" if one.name == "auto" else "") + (" *" if missing else "")
            interval = "" if one is peer else f"{middle:>9.2g}  {low:.2g} to {high:.2g}"
            verdict = ""
            if one.name == "auto":
                ratios.append(middle)
                verdict = "  holds" if middle <= bound else "  ABOVE"
            figures = f"{one.spp:>6}{one.spent:>8.2f}{errors.mean():>11.5f}{one.light / peer.light:>7.3f}{interval}{verdict}"
            print(f"  {a.seconds * share:>4g} s  {name:<22}{figures}", flush=True)
        if share == 1.0 and "path" in a.methods:
            print_costs(a, path, size, scene, next(one for one in all_ours if one.name == "path"), peer, reference)
    return ratios


def main():
    parser = argparse.ArgumentParser(prog="other_scenes", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("places", nargs="+", metavar="PLACE", help="scene files, and folders of them")
    parser.add_argument("--root", default=".", help=argparse.SUPPRESS)
    parser.add_argument("--seconds", type=float, default=10.0, help=f"processor seconds on each of {CORES} cores (10)")
    parser.add_argument("--seeds", type=int, default=4, help="pictures of each renderer (4, the least)")
    parser.add_argument("--width", type=int, default=256, help="of all pictures, whose height follows from the scene's (256)")
    parser.add_argument("--methods", nargs="+", default=METHODS, metavar="NAME", help=f"of ours ({' '.join(METHODS)})")
    parser.add_argument("--program", metavar="FILE", help="ours (target/release/pointillist)")
    a = parser.parse_args()
    if a.seeds < 4:
        parser.error("--seeds: an interval from fewer than 4 pictures says nothing")
    results = []
    print(f"{a.width} pixels wide, {a.seeds} seeds; columns: time, renderer, samples per pixel, processor seconds, error, light over Mitsuba's, ratio")
    for path in scenes(a.places):
        print(path, flush=True)
        results.append(measure(a, str(path)))
    if "auto" not in a.methods:
        return
    failed = False
    for i, (share, bound) in enumerate(TIMES):
        at = [r[i] for r in results]
        mean = float(np.exp(np.mean(np.log(at))))
        failed |= max(at) > bound or (share == 1.0 and mean > LARGEST_MEAN)
        of_mean = f" (bound {LARGEST_MEAN})" if share == 1.0 else ""
        print(f"auto after {a.seconds * share:g} s: worst ratio {max(at):.2g} (bound {bound:g}), geometric mean {mean:.2g}{of_mean}")
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
