"""Does a picture of Pointillist agree with one of Mitsuba 3 (scalar_spectral) on the same scene file?

Both programs render the scene R times with independent seeds and the box filter. Neither the noise within a pixel
(which says nothing for quasi-Monte Carlo points) nor any assumption about it enters: mean and variance of the mean
come from the R repetitions of each side.

Tests, per pixel and channel, and again for blocks of 4x4 pixels:
  Welch's t with Welch-Satterthwaite degrees of freedom, which is right for two small groups of unequal variance;
  two-sided p values from the t distribution, not the normal one, at the 1 % level with Sidak's correction for the
  number of comparisons; at least 99.75 % must be accepted (the rule of Mitsuba's own test_renders.py).
  A pixel's repetitions are skewed when few samples find the light; the mean of 16 neighbours is close to normal, and
  shows a bias four times smaller. Hence both.
  The two programs do not have the same observer tables (1 nm, 5 nm): differences up to --tolerance of the value
  count as none.
Means of the whole picture must agree within 0.2 %, and their standard errors are printed.
relMSE is mean((a - b)^2 / (Y_b^2 + 0.01)), with the noise of both sides taken off.

--all does this for every scene of one plugin, scenes/plugins/*.xml, or those whose names contain one of the words given:
  renderings are added until the means of all channels are known to 0.1 %, as long as there is time (--minutes). Means may
  differ by 0.3 %, and what is beyond that must be more than three standard errors to count against a scene.
  A scene says in a comment how it is compared: `compare: rgb` against Mitsuba's RGB mode, where its spectral mode has a known
  fault; `compare: none` where Mitsuba has no such plugin. The table goes to OUT/all.md and OUT/all.json.

Exit status: 0 the pictures agree, 1 they do not (or there is too much noise to tell), 2 something could not be run.
"""

import argparse
import json
import os
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path
import xml.etree.ElementTree as ElementTree

import numpy as np

LEVEL = 0.01
ACCEPTED = 0.9975
MEAN_WITHIN = 0.002
ALL_MEAN_WITHIN = 0.003
ALL_MEAN_ERROR = 0.001
ALL_SEEDS = 12
ALL_MOST_SEEDS = 48
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


def arguments():
    p = argparse.ArgumentParser(
        prog="compare_mitsuba", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    p.add_argument("scene", nargs="*", help="Mitsuba 3 scene file (not with --self-test); with --all parts of names")
    p.add_argument("--all", action="store_true", help="every scene of scenes/plugins")
    p.add_argument("--folder", help="with --all: the folder of the scenes (scenes/plugins)")
    p.add_argument("--minutes", type=float, default=20, help="with --all: time after which nothing is added (20)")
    p.add_argument("--root", default=".", help=argparse.SUPPRESS)
    p.add_argument("--spp", type=int, default=64, help="samples per pixel of one Mitsuba rendering (64)")
    p.add_argument("--our-spp", type=int, help="samples per pixel of one Pointillist rendering (as --spp)")
    p.add_argument("--seeds", type=int, default=16, help="renderings on each side (16, at least 4)")
    p.add_argument("--size", help="WxH instead of the size in the scene, for both")
    p.add_argument("-D", dest="define", action="append", default=[], metavar="NAME=VALUE", help="scene parameter")
    p.add_argument("--variant", default="scalar_spectral", help="Mitsuba's (scalar_spectral; scalar_rgb where it has no colours)")
    p.add_argument("--tolerance", type=float, default=0.001, help="relative difference that counts as none (0.001)")
    p.add_argument("--binary", help="the program (target/release/pointillist)")
    p.add_argument("--integrator", metavar="NAME", help="of ours: handed on as it is (the method of the scene)")
    p.add_argument("--device", default="cpu", help="its --device (cpu)")
    p.add_argument("--out", help="folder for means and t values (target/compare_mitsuba/SCENE)")
    p.add_argument("--self-test", action="store_true", help="Mitsuba against itself: equal passes, 1 %% brighter fails")
    a = p.parse_args()
    if a.seeds < 4:
        p.error("--seeds: a variance from fewer than 4 renderings says nothing")
    if len(a.scene) != 1 and not a.self_test and not a.all:
        p.error("which scene?")
    return a


class Failed(SystemExit):
    """Something that could not be run; ends a program that does not catch it with its message."""


# Mitsuba's half


# The angle in degrees under which Mitsuba 3 shows the sun by default.
SUN_APERTURE = 0.5358


def upgrade(tree):
    """Changes what Mitsuba 3 does not by itself in a file for Mitsuba 0.6: its skies have +y up instead of +z, it filters textures over
    the footprint of a pixel, and a transform may be written lookAt."""
    if tree.getroot().get("version", "3").split(".")[0] != "0":
        return
    for element in list(tree.iter("lookAt")):
        element.tag = "lookat"
    for element in tree.iter("string"):
        if element.get("name") == "filterType" and element.get("value") in ("trilinear", "ewa"):
            element.set("value", "bilinear")
    for sky in tree.iter("emitter"):
        if sky.get("type") not in ("sky", "sun", "sunsky") or sky.find("transform") is not None:
            continue
        for child in list(sky):
            name = child.get("name")
            if name == "sunRadiusScale":
                child.attrib = {"name": "sun_aperture", "value": str(SUN_APERTURE * float(child.get("value")))}
        turned = ElementTree.SubElement(sky, "transform", name="to_world")
        ElementTree.SubElement(turned, "rotate", x="1", angle="-90")


def box_filtered(scene, size, integrator=None):
    """The text of the scene file with a box filter, float32 RGB pixels and, if given, another size and another integrator."""
    tree = ElementTree.parse(scene)
    upgrade(tree)
    if integrator:
        # Mitsuba creates what the file names, even if the caller renders by another one.
        for element in tree.iter("integrator"):
            element.clear()
            element.set("type", integrator)
    films = list(tree.iter("film"))
    if not films:
        raise Failed(f"{scene} has no <film> of its own: put the sensor into this file")
    for film in films:
        replaced = {"pixel_format", "component_format"} | ({"width", "height"} if size else set())
        for child in list(film):
            if child.tag == "rfilter" or child.get("name") in replaced:
                film.remove(child)
        ElementTree.SubElement(film, "rfilter", type="box")
        ElementTree.SubElement(film, "string", name="pixel_format", value="rgb")
        ElementTree.SubElement(film, "string", name="component_format", value="float32")
        for name, value in zip(("width", "height"), size or ()):
            ElementTree.SubElement(film, "integer", name=name, value=str(value))
    return ElementTree.tostring(tree.getroot(), encoding="unicode")


def load_box_filtered(mi, scene, defines, size, integrator=None):
    """The scene in Mitsuba, with film and integrator of box_filtered()."""
    with tempfile.TemporaryDirectory() as place:
        copy = os.path.join(place, "scene.xml")
        with open(copy, "w") as f:
            f.write(box_filtered(scene, size, integrator))
        mi.file_resolver().prepend(os.path.dirname(os.path.abspath(scene)))
        config = mi.parser.ParserConfig(mi.variant())
        # Files for Mitsuba 0.6 have properties that Mitsuba 3 lacks.
        config.unused_properties = mi.LogLevel.Warn
        state = mi.parser.parse_file(config, copy, **defines)
        mi.parser.transform_all(config, state)
        return mi.parser.instantiate(config, state)


def mitsuba_renderings(mi, scene, defines, size, spp, seeds):
    """Array (seed, y, x, channel) of linear Rec.709."""
    loaded = load_box_filtered(mi, scene, defines, size)
    return np.stack([np.array(mi.render(loaded, spp=spp, seed=seed))[..., :3] for seed in seeds]).astype(np.float64)


# Pointillist's half


def main_layer(mi, path):
    """R, G, B of the main layer of an EXR file, as (y, x, channel)."""
    bitmap = mi.Bitmap(path)
    names = [field.name for field in bitmap.struct_()]
    pixels = np.array(bitmap)
    try:
        return pixels[..., [names.index(c) for c in "RGB"]].astype(np.float64)
    except ValueError:
        raise Failed(f"{path} has no channels R, G, B, only {', '.join(names)}") from None


def our_renderings(mi, a, scene, defines, size, spp, seeds):
    binary = a.binary or os.path.join(a.root, "target", "release", "pointillist")
    if not os.path.exists(binary):
        raise Failed(f"no program at {binary}: cargo build --release, or --binary")
    images = []
    with tempfile.TemporaryDirectory() as place:
        for seed in seeds:
            file = os.path.join(place, f"{seed}.exr")
            command = [binary, "render", str(scene), "-o", file, "--filter", "box", "--spp", str(spp)]
            command += ["--seed", str(seed), "--device", a.device, "--quiet"]
            command += ["--size", f"{size[0]}x{size[1]}"] if size else []
            command += ["--integrator", a.integrator] if a.integrator else []
            for name, value in defines.items():
                command += ["-D", f"{name}={value}"]
            done = subprocess.run(command, capture_output=True, text=True)
            if done.returncode != 0 or not os.path.exists(file):
                raise Failed(f"failed ({done.returncode}): {' '.join(command)}\n{done.stderr}")
            images.append(main_layer(mi, file))
    return np.stack(images)


# Statistics


def t_p_value(t, dof):
    """Two-sided p value of Student's t: the incomplete beta function I_x(dof/2, 1/2) at x = dof/(dof + t^2)."""
    from math import lgamma

    log_gamma = np.vectorize(lgamma, otypes=[float])
    a, b, x = dof / 2, np.full_like(dof, 0.5), dof / (dof + t * t)
    # The continued fraction (Abramowitz, Stegun 26.5.8) converges fast on one side; the other follows by symmetry.
    flip = x > (a + 1) / (a + b + 2)
    a, b, x = np.where(flip, b, a), np.where(flip, a, b), np.where(flip, 1 - x, x)
    x = np.clip(x, 1e-300, 1 - 1e-16)
    front = np.exp(log_gamma(a + b) - log_gamma(a) - log_gamma(b) + a * np.log(x) + b * np.log1p(-x)) / a
    c, d = np.ones_like(x), 1 / (1 - (a + b) * x / (a + 1))
    fraction = d.copy()
    for m in range(1, 200):
        for top in (
            m * (b - m) * x / ((a + 2 * m - 1) * (a + 2 * m)),
            -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1)),
        ):
            d, c = 1 / (1 + top * d), 1 + top / c
            fraction *= c * d
    tail = front * fraction
    return np.where(flip, 1 - tail, tail)


def welch(ours, theirs, tolerance):
    """t, degrees of freedom and the two variances of the mean, from arrays whose first axis is the seed."""
    a, b = ours.mean(0), theirs.mean(0)
    va, vb = ours.var(0, ddof=1) / len(ours), theirs.var(0, ddof=1) / len(theirs)
    # Rounding of single precision, for pixels that both know without noise.
    variance = np.maximum(va + vb, (1e-6 * np.abs(b)) ** 2 + 1e-24)
    dof = variance**2 / np.maximum(va**2 / (len(ours) - 1) + vb**2 / (len(theirs) - 1), 1e-300)
    dof = np.clip(dof, 1, len(ours) + len(theirs) - 2)
    excess = np.maximum(np.abs(a - b) - tolerance * np.abs(b), 0)
    return np.sign(a - b) * excess / np.sqrt(variance), dof, va, vb


def blocks(images, n):
    """Means of n x n pixels; what is left over at the right and bottom edge is dropped."""
    r, h, w, c = images.shape
    cut = images[:, : h // n * n, : w // n * n]
    return cut.reshape(r, h // n, n, w // n, n, c).mean((2, 4))


def unusable(ours, theirs):
    """Why the pictures cannot be compared, if so."""
    if ours.shape[1:] != theirs.shape[1:]:
        return f"sizes differ: ours {ours.shape[1:]}, Mitsuba's {theirs.shape[1:]}"
    if not (np.isfinite(ours).all() and np.isfinite(theirs).all()):
        return f"not finite: {(~np.isfinite(ours)).sum()} values of ours, {(~np.isfinite(theirs)).sum()} of Mitsuba's"
    return None


def accepted(ours, theirs, tolerance, n):
    """For blocks of n x n pixels: p values, the level of each, the share above it, and t values."""
    t, dof, _, _ = welch(blocks(ours, n), blocks(theirs, n), tolerance)
    p = t_p_value(t, dof)
    level = 1 - (1 - LEVEL) ** (1 / p.size)
    return p, level, (p > level).mean(), t


def means(ours, theirs):
    """Of each channel: both means, their standard errors, the relative difference and its standard error."""
    rows = []
    for c in range(3):
        a, b = (x[..., c].mean((1, 2)) for x in (ours, theirs))
        ea, eb = (x.std(ddof=1) / np.sqrt(len(x)) for x in (a, b))
        scale = max(abs(b.mean()), 1e-12)
        rows.append((a.mean(), ea, b.mean(), eb, (a.mean() - b.mean()) / scale, np.hypot(ea, eb) / scale))
    return rows


def compare(ours, theirs, tolerance):
    """Prints the table; true if the pictures agree. Also returns the t values per pixel."""
    if problem := unusable(ours, theirs):
        print(problem)
        return False, None
    good, t_map = True, None
    print(f"{'test':12} {'compared':>9} {'critical p':>11} {'accepted':>10} {'|t| > 5 % level':>16}  verdict")
    for n in (1, 4):
        p, level, share, t = accepted(ours, theirs, tolerance, n)
        passed = share >= ACCEPTED
        print(
            f"{'pixels' if n == 1 else f'{n}x{n} blocks':12} {p.size:9} {level:11.2e} {share:10.4%} "
            f"{(p < 0.05).mean():16.2%}  {'ok' if passed else 'DIFFERENT'}"
        )
        good &= passed
        t_map = t if n == 1 else t_map
    print(f"\n{'mean':12} {'ours':>11} {'std. error':>10} {'Mitsuba':>11} {'std. error':>10} {'difference':>18}  verdict")
    for name, (a, ea, b, eb, off, error) in zip("RGB", means(ours, theirs)):
        verdict = "ok" if abs(off) <= MEAN_WITHIN else "DIFFERENT" if abs(off) > 3 * error else "TOO NOISY: more --spp"
        good &= verdict == "ok"
        print(f"{name:12} {a:11.6f} {ea:10.2e} {b:11.6f} {eb:10.2e} {off:+9.3%} ±{error:7.3%}  {verdict}")
    _, _, va, vb = welch(ours, theirs, 0)
    a, b = ours.mean(0), theirs.mean(0)
    weight = 1 / ((b @ LUMINANCE)[..., None] ** 2 + 0.01)
    raw, bias = ((a - b) ** 2 * weight).mean(), (((a - b) ** 2 - va - vb) * weight).mean()
    noise = [(v * len(x) * weight).mean() for v, x in ((va, ours), (vb, theirs))]
    print(f"\nrelMSE {raw:.3e}, without the noise of both {bias:+.3e}")
    print(f"relMSE of one rendering by its own noise: ours {noise[0]:.3e}, Mitsuba's {noise[1]:.3e}")
    return bool(good), t_map


SELF_TEST = """<scene version="3.0.0"><default name="light" value="0.5 0.6 0.8"/><integrator type="path"><integer name="max_depth" value="4"/></integrator>
<sensor type="perspective"><transform name="to_world"><lookat origin="0,-4,2" target="0,0,0.5" up="0,0,1"/></transform>
<film type="hdrfilm"><integer name="width" value="64"/><integer name="height" value="48"/></film></sensor>
<emitter type="constant"><rgb name="radiance" value="$light"/></emitter>
<shape type="rectangle"><transform name="to_world"><scale value="5"/></transform><bsdf type="diffuse">
<rgb name="reflectance" value="0.6 0.4 0.2"/></bsdf></shape><shape type="sphere"><point name="center" value="0,0,1"/></shape>
</scene>"""


def self_test(mi, a):
    with tempfile.TemporaryDirectory() as place:
        scene = os.path.join(place, "self.xml")
        with open(scene, "w") as f:
            f.write(SELF_TEST)
        one = mitsuba_renderings(mi, scene, {}, None, a.spp, range(a.seeds))
        two = mitsuba_renderings(mi, scene, {}, None, a.spp, range(1000, 1000 + a.seeds))
    print("— Mitsuba against Mitsuba with other seeds: must agree")
    equal, _ = compare(one, two, a.tolerance)
    print("\n— Mitsuba against Mitsuba, 1 % brighter: must differ")
    brighter, _ = compare(one * 1.01, two, a.tolerance)
    print("\n— Mitsuba against Mitsuba, 8x8 pixels 30 % brighter: must differ")
    one[:, 8:16, 8:16] *= 1.3
    spot, _ = compare(one, two, a.tolerance)
    return equal and not brighter and not spot


# Every scene


def mode_of(scene):
    """How a scene wants to be compared: spectral, rgb or none."""
    comments = re.findall(r"<!--(.*?)-->", scene.read_text(), re.DOTALL)
    found = [m for c in comments for m in re.findall(r"\bcompare: (\w+)", c)]
    mode = found[0] if found else "spectral"
    if mode not in ("spectral", "rgb", "none"):
        raise Failed(f"{scene} asks for `compare: {mode}`; it is spectral, rgb or none")
    return mode


def compare_one(mi, a, scene, out, deadline):
    """A row of the table."""
    start, mode = time.monotonic(), mode_of(scene)
    row = {"scene": scene.stem, "mode": mode, "verdict": "not compared"}
    if mode == "none":
        return row
    mi.set_variant(f"scalar_{mode}")
    ours, theirs = [], []
    while True:
        seeds = range(len(ours) * ALL_SEEDS + 1, (len(ours) + 1) * ALL_SEEDS + 1)
        ours.append(our_renderings(mi, a, scene, {}, None, a.our_spp or a.spp, seeds))
        theirs.append(mitsuba_renderings(mi, str(scene), {}, None, a.spp, [1000 + s for s in seeds]))
        both = np.concatenate(ours), np.concatenate(theirs)
        if problem := unusable(*both):
            raise Failed(problem)
        channels = means(*both)
        noisy = max(error for *_, error in channels) > ALL_MEAN_ERROR
        if not noisy or len(ours) * ALL_SEEDS >= ALL_MOST_SEEDS or time.monotonic() > deadline:
            break
    (_, _, pixels, t), (_, _, groups, _) = (accepted(*both, a.tolerance, n) for n in (1, 4))
    missed = [abs(off) - ALL_MEAN_WITHIN > 3 * error for *_, off, error in channels]
    outside = [abs(off) > ALL_MEAN_WITHIN for *_, off, _ in channels]
    verdict = "DIFFERENT" if min(pixels, groups) < ACCEPTED or any(missed) else "unclear" if any(outside) else "ok"
    (out / scene.stem).mkdir(parents=True, exist_ok=True)
    for file, image in (("ours", both[0].mean(0)), ("mitsuba", both[1].mean(0)), ("t", t)):
        mi.Bitmap(image.astype(np.float32)).write(str(out / scene.stem / f"{file}.exr"))
    ratios = [{"ratio": 1 + off, "error": error} for *_, off, error in channels]
    row |= {"pixels": pixels, "blocks": groups, "means": ratios, "verdict": verdict, "noisy": noisy}
    return row | {"renderings": len(both[0]), "seconds": time.monotonic() - start}


def line_of(row):
    """A row as Markdown."""
    if "means" not in row:
        return f"| {row['scene']} | {row.get('mode', '')} | | | | | | | | {row['verdict']} |"
    ratios = " | ".join(f"{m['ratio']:.4f} ± {m['error']:.4f}" for m in row["means"])
    end = row["verdict"] + (", means known to more than 0.1 %" if row["noisy"] else "")
    start = f"| {row['scene']} | {row['mode']} | {row['pixels']:.2%} | {row['blocks']:.2%} | {ratios}"
    return f"{start} | {row['renderings']} | {row['seconds']:.0f} s | {end} |"


def compare_all(mi, a):
    """Compares every scene of one plugin; the exit status."""
    folder = Path(a.folder or Path(a.root, "scenes", "plugins"))
    scenes = sorted(folder.glob("*.xml"))
    scenes = [s for s in scenes if not a.scene or any(word in s.stem for word in a.scene)]
    if not scenes:
        raise Failed(f"no scene of {folder} has such a name")
    out = Path(a.out or Path(a.root, "target", "compare_mitsuba"))
    out.mkdir(parents=True, exist_ok=True)
    deadline = time.monotonic() + 60 * a.minutes
    head = "| scene | mode | pixels | 4×4 blocks | R | G | B | renderings | time | verdict |\n" + 10 * "|---" + "|"
    print(head, flush=True)
    rows = []
    for scene in scenes:
        try:
            row = compare_one(mi, a, scene, out, deadline)
        except (Failed, RuntimeError) as e:
            row = {"scene": scene.stem, "verdict": "FAILED: " + " ".join(str(e).split())[:300].replace("|", "/")}
        rows.append(row)
        print(line_of(row), flush=True)
    (out / "all.md").write_text("\n".join([head, *map(line_of, rows)]) + "\n")
    (out / "all.json").write_text(json.dumps(rows, indent=1, default=lambda value: value.item()) + "\n")
    verdicts = [row["verdict"].split(":")[0] for row in rows]
    count = ", ".join(f"{verdicts.count(v)} {v}" for v in dict.fromkeys(verdicts))
    print(f"\n{len(rows)} scenes: {count}; {out}/all.md and all.json")
    return 2 if "FAILED" in verdicts else int("DIFFERENT" in verdicts)


def main():
    try:
        sys.exit(run(arguments()))
    except Failed as e:
        print(f"compare_mitsuba: {e}", file=sys.stderr)
        sys.exit(2)


def run(a):
    """The exit status."""
    import mitsuba as mi

    mi.set_variant(a.variant)
    if a.self_test:
        return 0 if self_test(mi, a) else 1
    if a.all:
        return compare_all(mi, a)
    [scene] = a.scene
    size = tuple(int(v) for v in a.size.lower().split("x")) if a.size else None
    defines = dict(d.split("=", 1) for d in a.define)
    ours = our_renderings(mi, a, scene, defines, size, a.our_spp or a.spp, range(1, a.seeds + 1))
    theirs = mitsuba_renderings(mi, scene, defines, size, a.spp, range(1001, 1001 + a.seeds))
    print(f"{scene}: {theirs.shape[2]}x{theirs.shape[1]}, {a.seeds} seeds, spp {a.our_spp or a.spp} (ours), {a.spp}")
    good, t_map = compare(ours, theirs, a.tolerance)
    name = os.path.splitext(os.path.basename(scene))[0]
    out = a.out or os.path.join(a.root, "target", "compare_mitsuba", name)
    os.makedirs(out, exist_ok=True)
    for file, image in (("ours", ours.mean(0)), ("mitsuba", theirs.mean(0)), ("t", t_map)):
        if image is not None:
            mi.Bitmap(image.astype(np.float32)).write(os.path.join(out, file + ".exr"))
    print(f"means and t values: {out}")
    return 0 if good else 1


if __name__ == "__main__":
    main()
