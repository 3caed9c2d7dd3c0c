"""On what share of the list of hard cases for materials do those of Mitsuba 3 fail?

The list and the criteria are those of tests/stability/bsdf/ (`cargo test --test stability every_material -- --nocapture`): every material x
roughness x index x incidence, from both sides where light passes. A case fails
  finite   if a sample or a value is NaN, infinite or negative, also for random numbers of 0 and 1 - 2^-24,
  density  if the density, with the probability of deltas and of no sample, does not integrate to 1 within 1e-3,
  mean     if the mean weight of samples is not the integral of the values within 1e-3,
  energy   if more light leaves than arrives (by more than 1e-3), or less where the material is smooth and loses nothing,
  weight   if the weight of a sample is not value over density within 1 %,
  sampled  if the densities of a sample and of its evaluation differ by a factor of 1.5.
Integrals are taken over facet normals in double precision, as in the test. Materials that refuse an index or a roughness are not counted.

--part 10 takes every tenth material. The table goes to stdout. It takes about half an hour.
"""

import argparse
import sys
from collections import Counter, defaultdict

import drjit as dr
import mitsuba as mi
import numpy as np

ROUGHNESSES = [0, 1e-6, 1e-4, 1e-2, 0.1, 0.5, 1]
INDICES = [1, float(np.float32(1 + 1e-7)), 1.0003, 1.5, 2.4, 4, 200]
INCIDENCES = [0, 30, 60, 80, 89, 89.9, 89.9999]
EXACT, WEIGHTS, DENSITIES = 1e-3, 1e-2, 1.5
FEWEST, MOST = 1 << 11, 1 << 18
WIDE = 0.3
ON_EDGE = 3.0
GRID = 1 << 24


def lattice(n):
    steps = np.array([0.7548776662466927, 0.5698402909980532])
    i = np.arange(n)[:, None]
    return np.concatenate([np.modf(0.5 + steps[None, :] * (i + 1))[0], (i + 0.5) / n], 1)


def numbers(u):
    return (np.minimum((u * GRID).astype(np.int64), GRID - 1) / GRID).astype(np.float32)


def materials():
    """Name, plugin, alphas of facets that mirror, that refract and that let through a pane, index, index behind, passes, least and most energy."""
    white = {"type": "rgb", "value": [1, 1, 1]}
    ones = {"specular_reflectance": white}
    both = dict(ones, specular_transmittance=white)

    def metal(eta, k):
        return dict(ones, eta={"type": "rgb", "value": [float(eta)] * 3}, k={"type": "rgb", "value": [float(k)] * 3})

    def rough(plugin, alpha, facets, **more):
        return dict(type=plugin, alpha=alpha, distribution=facets, **more)

    yield "diffuse", dict(type="diffuse", reflectance=white), [1, 1, 1], 1, 1, False, 1, 1
    for n in map(float, INDICES):
        iors = dict(int_ior=n, ext_ior=1.0)
        yield "dielectric", dict(type="dielectric", **iors, **both), [1, 1, 1], n, n, True, 1, 1
        yield "thindielectric", dict(type="thindielectric", **iors, **both), [1, 1, 1], n, 1, True, 1, 1
        yield "conductor, k = 0", dict(type="conductor", **metal(n, 0)), [1, 1, 1], n, 1, False, 0, 1
        yield "conductor, k = 3", dict(type="conductor", **metal(n, 3)), [1, 1, 1], n, 1, False, 0, 1
        yield "conductor, index 0", dict(type="conductor", **metal(0, n)), [1, 1, 1], n, 1, False, 1, 1
        plastic = dict(diffuse_reflectance=white, **ones, **iors)
        yield "plastic", dict(type="plastic", **plastic), [1, 1, 1], n, 1, False, 0, 1.01
        for alpha in map(float, ROUGHNESSES):
            a = [max(alpha, 1e-4)] * 3
            for facets in ["ggx", "beckmann"]:
                for name, eta, k in [("k = 0", n, 0), ("k = 3", n, 3), ("index 0", 0, n)]:
                    plugin = rough("roughconductor", alpha, facets, **metal(eta, k))
                    yield f"roughconductor, {name}", plugin, a, n, 1, False, 0, 1
                glass = rough("roughdielectric", alpha, facets, **iors, **both)
                yield "roughdielectric", glass, a, n, n, True, 0, 1
            yield "roughplastic", rough("roughplastic", alpha, "ggx", **plastic), a, n, 1, False, 0, 1.02
            part = rough("roughdielectric", alpha, "ggx", **iors, **both)
            base = {"type": "diffuse", "reflectance": white}
            blend = {"type": "blendbsdf", "weight": 0.7, "first": part, "second": base}
            yield "blendbsdf", blend, a, n, n, True, 0, 1
            a = [max(alpha, 1e-3)] * 2 + [max(alpha * (0.65 * n - 0.35) ** 2, 1e-3)]
            under_coat = [min(a[0], 0.05)] + a[1:]
            facets = dict(base_color=white, roughness=alpha**0.5)
            coat = dict(clearcoat=1.0, clearcoat_gloss=0.5, metallic=0.3, sheen=0.3)
            for name, more, behind, widths in [
                ("principled", dict(spec_trans=0.0), 1, a),
                ("principled, coated", dict(spec_trans=0.3, **coat), n, under_coat),
                ("principled, glass", dict(spec_trans=1.0), n, a),
            ]:
                yield name, dict(type="principled", eta=n, **facets, **more), widths, n, behind, behind != 1, 0, 2.2
            thin = dict(type="principledthin", eta=n, spec_trans=0.5, diff_trans=1.0, **facets)
            yield "principledthin", thin, a, n, 1, True, 0, 2.2


def normals(m, alpha):
    """Density of normals whose tan over alpha is s = u / (1 - u): a tail heavier than that of any facets."""
    s = np.maximum(np.hypot(m[:, 0], m[:, 1]) / (np.maximum(m[:, 2], 1e-300) * alpha), 1e-12)
    return np.where(m[:, 2] > 0, 1 / (2 * np.pi * s * (1 + s) ** 2 * alpha**2 * m[:, 2] ** 3), 0)


def normalised(v):
    return v / np.linalg.norm(v, axis=1)[:, None]


class Directions:
    """As `Directions` in tests/stability/bsdf/quadrature.rs."""

    def __init__(self, wo, alpha, eta):
        self.wo, self.alpha, self.eta = wo, alpha, eta

    def has(self, kind):
        bent = 1 if self.eta == 1 else min(abs(self.eta - 1), 1)
        width = self.alpha[0] if kind == 1 else self.alpha[2] if self.eta == 1 else self.alpha[1] * bent
        return kind % 2 == 0 or not WIDE <= width < ON_EDGE

    def at(self, kind, u, v):
        wo, eta = self.wo, self.eta
        pane = kind == 3 and eta == 1
        turn = [np.cos(2 * np.pi * v), np.sin(2 * np.pi * v)]
        tan = self.alpha[2 if pane else 0 if kind == 1 else 1] * u / (1 - u)
        m = normalised(np.stack([tan * turn[0], tan * turn[1], np.ones_like(u)], 1))
        cos = m @ wo
        if kind in (0, 2):
            z, r = (1 - u) * (1 if kind == 0 else -1), np.sqrt(u * (2 - u))
            wi, ok = np.stack([r * turn[0], r * turn[1], z], 1), np.full(u.shape, True)
        elif kind == 1 or pane:
            wi, ok = 2 * cos[:, None] * m - wo, cos > 0
            if pane:
                wi[:, 2] *= -1
        else:
            through2 = (eta - 1) * (eta + 1) + cos * cos
            ok = (cos > 0) & (through2 > 0)
            wi = (m * (cos - np.sqrt(np.maximum(through2, 0)))[:, None] - wo) / eta
        return wi[ok & ((wi[:, 2] > 0) == (kind < 2))]

    def density(self, wi):
        wo, eta = self.wo, self.eta
        density, below = 0.5 / np.pi, wi[:, 2] < 0
        folded = np.concatenate([wi[:, :2], np.abs(wi[:, 2:])], 1)
        m = normalised(wo + folded)
        above = normals(m, self.alpha[0]) / (4 * (m @ wo)) * self.has(1)
        if eta == 1:
            return density + np.where(below, normals(m, self.alpha[2]) / (4 * (m @ wo)) * self.has(3), above)
        half = wo + wi * eta
        length2 = (half**2).sum(1)
        facet = half / np.sqrt(length2)[:, None] * np.sign(half[:, 2:])
        cos, cos_i = facet @ wo, -(facet * wi).sum(1)
        refracted = np.where((cos > 0) & (cos_i > 0), normals(facet, self.alpha[1]) * eta**2 * cos_i / length2, 0)
        return density + np.where(below, refracted * self.has(3), above)


def interaction(wo, n):
    si = dr.zeros(mi.SurfaceInteraction3f, n)
    si.wi = mi.Vector3f(*[dr.opaque(mi.Float, float(c), n) for c in wo])
    return si


def evaluate(bsdf, wo, wi):
    value, pdf = bsdf.eval_pdf(mi.BSDFContext(), interaction(wo, len(wi)), mi.Vector3f(wi.astype(np.float32).T))
    return [np.broadcast_to(v, len(wi)).astype(np.float64) for v in (np.array(value)[0], np.array(pdf))]


def sample(bsdf, wo, u):
    u = numbers(u)
    s, weight = bsdf.sample(mi.BSDFContext(), interaction(wo, len(u)), mi.Float(u[:, 2]), mi.Point2f(u[:, :2].T))
    delta = np.array(mi.has_flag(s.sampled_type, mi.BSDFFlags.Delta)) | np.array(mi.has_flag(s.sampled_type, mi.BSDFFlags.Null))
    n = len(u)

    def whole(values):
        return np.broadcast_to(np.array(values), n).astype(np.float64)

    wi = np.broadcast_to(np.array(s.wo).T, (n, 3))
    eta = np.where(wi[:, 2] * wo[2] < 0, whole(s.eta), 1)
    return wi, whole(s.pdf), whole(np.array(weight)[0]), np.broadcast_to(delta, n), eta


def fault(bsdf, alpha, behind, passes, energy, wo):
    last = 1 - 1 / GRID
    corners = np.array([[a, b, c] for a in (0, last) for b in (0, last) for c in (0, last)])
    with np.errstate(all="ignore"):
        _, pdf, weight, _, _ = sample(bsdf, wo, corners)
        used = weight != 0
        if not (np.isfinite(weight).all() and np.isfinite(pdf[used]).all() and (weight >= 0).all()):
            return "finite"
        wi, pdf, weight, delta, _ = sample(bsdf, wo, lattice(512))
        some = (pdf > 0) & ~delta & (weight > 0)
        if some.any():
            value, density = evaluate(bsdf, wo, wi[some])
            other, w = value / density, weight[some]
            if not np.isfinite(value).all():
                return "finite"
            if not (np.abs(other - w) <= WEIGHTS * np.maximum(np.maximum(other, w), 1e-6)).all():
                return "weight"
            quotient = density / pdf[some]
            if not ((quotient < DENSITIES) & (quotient > 1 / DENSITIES)).all():
                return "sampled"
        side = np.sign(wo[2])
        up = np.array([1, 1, side])
        eta = behind if side > 0 else 1 / behind
        w = (wo * up).astype(np.float64)
        ways = Directions(w / np.linalg.norm(w), alpha, eta)
        points = FEWEST
        while True:
            u = lattice(points)
            density = returned = 0.0
            for kind in filter(ways.has, range(4 if passes else 2)):
                wi = ways.at(kind, u[:, 0], u[:, 1])
                if len(wi) == 0:
                    continue
                value, pdf = evaluate(bsdf, wo, wi * up)
                if not (np.isfinite(value).all() and np.isfinite(pdf).all() and (value >= 0).all()):
                    return "finite"
                per = 1 / ways.density(wi) / points
                density += (pdf * per).sum()
                returned += (value * per * np.where(wi[:, 2] < 0, eta**2, 1)).sum()
            wi, pdf, weight, delta, index = sample(bsdf, wo, u)
            # Mitsuba may leave a direction and a density to a sample that it has discarded.
            value, pdf = evaluate(bsdf, wo, wi)
            none = ~delta & (~(pdf > 0) | (weight == 0) & (value > 0))
            weight = weight * index**2
            total = density + (none | delta).mean()
            returned += (weight * delta).mean()
            mean = weight.mean()
            if not abs(total - 1) <= EXACT:
                found = "density"
            elif not abs(mean - returned) <= EXACT * max(returned, 1):
                found = "mean"
            elif not energy[0] - EXACT <= returned <= energy[1] + EXACT:
                found = "energy"
            else:
                return None
            if points >= MOST:
                return found
            points *= 8


def main():
    p = argparse.ArgumentParser(prog="bsdfs_mitsuba", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("--part", type=int, default=1, help="take every n-th material (1)")
    p.add_argument("--only", default="", help="take materials whose names begin with this")
    p.add_argument("--most", type=int, default=MOST, help="points of an integral at most (2^20)")
    a = p.parse_args()
    globals()["MOST"] = a.most
    mi.set_variant("llvm_ad_rgb")
    mi.set_log_level(mi.LogLevel.Error)
    found, refused = defaultdict(Counter), Counter()
    for name, plugin, alpha, index, behind, passes, least, most in list(materials())[:: a.part]:
        if not name.startswith(a.only):
            continue
        try:
            bsdf = mi.load_dict(plugin)
        except RuntimeError as error:
            refused[name] += 1
            print(f"{name}, index {index}: {str(error).splitlines()[-1]}", file=sys.stderr)
            continue
        for side in [1, -1] if passes else [1]:
            for degrees in INCIDENCES:
                angle = np.radians(degrees)
                sin, cos = np.sin(angle), np.cos(angle)
                wo = np.array([sin * np.cos(0.7), sin * np.sin(0.7), side * cos]).astype(np.float32)
                found[name][fault(bsdf, alpha, behind, passes, [least, most], wo) or "right"] += 1
    kinds = ["finite", "density", "mean", "energy", "weight", "sampled"]
    print("| material | cases | fail | " + " | ".join(kinds) + " |")
    print("|---|---|---|" + "---|" * len(kinds))
    total = Counter()
    for name in sorted(found) + ["all"]:
        counts = found[name] if name != "all" else total
        total.update(counts) if name != "all" else None
        cases = sum(counts.values())
        share = 1 - counts["right"] / max(cases, 1)
        print(f"| {name} | {cases} | {share:.3f} | " + " | ".join(str(counts[k]) for k in kinds) + " |")
    print(f"\nMitsuba {mi.__version__}, llvm_ad_rgb. Refused: {sum(refused.values())} materials.")


if __name__ == "__main__":
    main()
