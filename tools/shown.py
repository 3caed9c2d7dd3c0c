"""The picture as it is shown, at equal processor time: Pointillist beside Blender's Cycles with OIDN.

For every scene, 512 x 512, box filter, this prints FLIP and the mean CIEDE2000 difference of
  ours, by the method that `auto` chooses: the pixels as they are, the program's own display of them ("display", a PNG file, where a
    wide kernel fills pixels without samples), and through the noise filter ("wavelet");
  Cycles 5.0 with OpenImageDenoise (albedo and normal, accurate prefilter, high quality), if the scene can be translated.
All are shown by one function, as Pointillist does: luminance Y becomes 1 - exp(-Y), colours that a display lacks lose
saturation, gamma 2.2.

Processor time is that of all threads, 2 per second for the times 1, 3 and 10 s on 2 cores. On a busy machine --threads 1 measures the
same work without threads that spin while others do not run. It counts
  ours: the tracer threads, and the noise filter with its rays; not loading, the choice of the method, and adding up samples, which
    the display does;
  Cycles: its samples, and OIDN; not loading, building the tree and copying the scene, measured as what a render of no
    samples would take.
Samples are chosen to fill the time; Cycles takes one per pixel where even that takes longer. The table says what was used.

Errors are against each program's own reference: spectra and RGB multiply colours differently. References are the mean of
R pictures of N samples per pixel (--references, --reference-spp), ours unbiased, Cycles' without denoiser and clamping, kept in
target/shown. "floor" is FLIP of the mean of one half of them against that of the other half, about twice what the noise of all
adds; it should be below a third of what is measured, and what is not is marked ~. "between references" is FLIP between the two programs',
with Cycles' mean brightness over ours by channel: it shows that both render the same scene.
Where its reference is too noisy, two more columns bound what Cycles' FLIP would be. "denoised" is against the mean of the same pictures
after OIDN, which favours Cycles: errors of OIDN that both share do not count. "ours" is against our reference.

--window measures the window after a move of the camera instead: see `tools/shown --window --help`.
"""

import argparse
import hashlib
import json
import os
import resource
import shlex
import subprocess
import sys
import tempfile
from dataclasses import asdict, dataclass
from pathlib import Path

import flip_evaluator
import mitsuba as mi
import numpy as np
from mitsuba_scene import Failed, main_layer

mi.set_variant("scalar_rgb")

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
BIGMESH = "target/meshes/bigmesh.xml"
SCENES = [f"scenes/{name}.xml" for name in ("cornell", "cornell_spheres", "cove", "veach_plates")] + [BIGMESH]
SCENES += [f"scenes/{name}.xml" for name in ("veach_door", "caustic", "rough", "prism", "instances")]
SCENES += ["scenes/staircase2/scene.xml", "scenes/veach-bidir/scene.xml"]
# Greatest share of a measured error that the reference's own may have.
FLOOR = 1 / 3
# The name of its row.
CYCLES = "Cycles + OIDN"
# Greatest relative difference between the time that was to be used and what was used, before a picture is made once more.
OFF = 0.1
# Side of what a montage shows of each picture, pixels.
CUT = 256


# Pictures


def displayed(linear):
    """Linear Rec.709 as the display shows it: encoded values in [0, 1]."""
    y = np.maximum(linear @ LUMINANCE, 0.0)
    shown = -np.expm1(-y)
    rgb = linear * (shown / np.maximum(y, 1e-20))[..., None]
    # Towards the grey of the same luminance, just far enough.
    least, most = rgb.min(-1), rgb.max(-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        keep = np.where(least < 0, shown / (shown - least), 1.0)
        keep = np.minimum(keep, np.where(most > 1, (1 - shown) / (most - shown), 1.0))
    rgb = shown[..., None] + (rgb - shown[..., None]) * np.nan_to_num(keep)[..., None]
    return np.clip(rgb, 0, 1) ** (1 / 2.2)


def flip(reference, test):
    """FLIP of two displayed pictures, mean over the picture."""
    pictures = (np.ascontiguousarray(p, dtype=np.float32) for p in (reference, test))
    return float(flip_evaluator.evaluate(*pictures, "LDR")[1])


def lab(encoded):
    """CIELAB of displayed pictures, as an sRGB screen shows them, D65."""
    linear = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    to_xyz = np.array([[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.1191920, 0.9503041]])
    t = linear @ (to_xyz / to_xyz.sum(1, keepdims=True)).T
    f = np.where(t > 216 / 24389, np.cbrt(t), (24389 / 27 * t + 16) / 116)
    return np.stack([116 * f[..., 1] - 16, 500 * (f[..., 0] - f[..., 1]), 200 * (f[..., 1] - f[..., 2])], -1)


def ciede2000(reference, test):
    """Mean colour difference of two displayed pictures (Sharma, Wu and Dalal 2005)."""
    (l1, a1, b1), (l2, a2, b2) = (np.moveaxis(lab(p), -1, 0) for p in (reference, test))
    c7 = (0.5 * (np.hypot(a1, b1) + np.hypot(a2, b2))) ** 7
    g = 1.5 - 0.5 * np.sqrt(c7 / (c7 + 25.0**7))
    c1, c2 = np.hypot(g * a1, b1), np.hypot(g * a2, b2)
    h1, h2 = (np.degrees(np.arctan2(b, g * a)) % 360 for a, b in ((a1, b1), (a2, b2)))
    turn = (h2 - h1 + 180) % 360 - 180
    turn = np.where(c1 * c2 == 0, 0, turn)
    dl, dc, dh = l2 - l1, c2 - c1, 2 * np.sqrt(c1 * c2) * np.sin(np.radians(turn / 2))
    lightness, chroma = 0.5 * (l1 + l2), 0.5 * (c1 + c2)
    hue = np.where(c1 * c2 == 0, h1 + h2, (h1 + turn / 2) % 360)
    cos = lambda degrees: np.cos(np.radians(degrees))
    t = 1 - 0.17 * cos(hue - 30) + 0.24 * cos(2 * hue) + 0.32 * cos(3 * hue + 6) - 0.2 * cos(4 * hue - 63)
    sl = 1 + 0.015 * (lightness - 50) ** 2 / np.sqrt(20 + (lightness - 50) ** 2)
    sc, sh = 1 + 0.045 * chroma, 1 + 0.015 * chroma * t
    c7 = chroma**7
    rt = -2 * np.sqrt(c7 / (c7 + 25.0**7)) * np.sin(np.radians(60 * np.exp(-(((hue - 275) / 25) ** 2))))
    return float(np.sqrt(np.maximum((dl / sl) ** 2 + (dc / sc) ** 2 + (dh / sh) ** 2 + rt * dc / sc * dh / sh, 0)).mean())


def layer(path, prefix):
    """R, G, B of a layer of an EXR file."""
    bitmap = mi.Bitmap(str(path))
    names = [field.name for field in bitmap.struct_()]
    return np.array(bitmap)[..., [names.index(prefix + c) for c in "RGB"]].astype(np.float64)


def write_png(path, encoded):
    part = path.with_name(f".{path.stem}.part.png")
    mi.Bitmap((np.clip(encoded, 0, 1) * 255 + 0.5).astype(np.uint8)).write(str(part))
    os.replace(part, path)


def kept(path, make):
    """The array in this file, made and stored if there is none."""
    if path.exists():
        return np.load(path)
    pixels = make().astype(np.float32)
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(f".{path.name}.part.npy")
    np.save(part, pixels)
    os.replace(part, path)
    return pixels


# The two programs


class Ours:
    """Renders of one scene by Pointillist."""

    def __init__(self, a, scene):
        self.a, self.scene = a, scene
        figures = self.render(["--integrator", a.integrator, "--spp", "1"])[1]
        self.method = figures["integrator"]

    def render(self, words, prefix="", name="a.exr"):
        """Pixels of a layer, the program's figures, and its processor time."""
        with tempfile.TemporaryDirectory() as place:
            file = os.path.join(place, name)
            command = [self.a.program, "render", self.scene, "-o", file, "--filter", "box", "--size", "x".join(map(str, self.a.size))]
            command += ["--device", "cpu", "--threads", str(self.a.threads), "--quiet", "--json", "-", *words]
            before = resource.getrusage(resource.RUSAGE_CHILDREN)
            done = subprocess.run(command, capture_output=True, text=True)
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
            if done.returncode != 0:
                raise Failed(f"{shlex.join(command)} failed: {' '.join(done.stderr.split())[:300]}")
            pixels = layer(file, prefix) if name.endswith(".exr") else np.array(mi.Bitmap(file))[..., :3] / 255.0
            return pixels, json.loads(done.stdout), after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime

    def of_method(self, method, *words, **more):
        return self.render(["--integrator", method, *words], **more)

    def reference_spp(self):
        return self.a.reference_spp

    def reference(self, spp, seed):
        # Photon mapping is biased.
        method = "bidirectional" if self.method == "photon" else self.method
        name = f"ours-{method}-{spp}-{seed}.npy"
        words = ["--spp", str(spp), "--seed", str(seed), "--replicates", "1"]
        return kept(self.a.store / name, lambda: self.of_method(method, *words)[0])

    def measure_rates(self):
        """Camera paths per processor second of the tracer, and the processor seconds of the noise filter."""
        self.of_method(self.method, "--spp", "1", "--seed", "900")
        _, figures, _ = self.of_method(self.method, "--spp", "4", "--seed", "901")
        self.rate = figures["camera_paths"] / figures["seconds"]["trace"]
        # A PNG file is the filtered picture itself, so that the two runs differ in nothing else.
        seconds = {
            kind: sorted(self.of_method(self.method, "--spp", "1", "--seed", "902", "--denoise", kind, name="a.png")[2] for _ in range(3))
            for kind in ("off", "wavelet")
        }
        self.filter = max(0.0, seconds["wavelet"][1] - seconds["off"][1])

    def shown(self, budget, seed, kind):
        """The picture that this many processor seconds give, encoded, its samples per pixel and its cost."""
        filter_time, denoise = (self.filter, "wavelet") if kind == "wavelet" else (0.0, "off")
        # The program's own PNG file is encoded already.
        prefix, name = ("denoised." if kind == "wavelet" else ""), ("a.png" if kind == "display" else "a.exr")
        for last in (False, True):
            words = ["--samples", str(max(1000, round(self.rate * (budget - filter_time)))), "--seed", str(seed), "--denoise", denoise]
            pixels, figures, _ = self.of_method(self.method, *words, prefix=prefix, name=name)
            trace = figures["seconds"]["trace"]
            # The speed of the machine may have changed.
            if last or abs((trace + filter_time) / budget - 1) < OFF:
                picture = pixels if kind == "display" else displayed(pixels)
                return picture, figures["samples_per_pixel"], trace + filter_time
            self.rate = figures["camera_paths"] / trace


class Cycles:
    """Renders of one scene by Blender, in a process of its own."""

    def __init__(self, a, scene):
        self.a, self.why_not, self.process = a, None, None
        self.scene = scene

    def start(self):
        size = "x".join(map(str, self.a.size))
        command = [sys.executable, str(Path(__file__).with_name("blender_scene.py")), self.scene, "--size", size]
        self.log = open(self.a.store / "blender.log", "w")
        command += ["--threads", str(self.a.threads)]
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self.log, text=True)
        answer = self.answer()
        self.why_not = answer.get("untranslatable")
        if self.why_not is None:
            # The first render builds the tree and loads the denoiser.
            self.render(1, 900, True)

    def answer(self):
        line = self.process.stdout.readline()
        if not line:
            raise Failed(f"Blender ended while it rendered {self.scene}; see {self.log.name}")
        return json.loads(line)

    def render(self, spp, seed, denoise, out=None, layers=False):
        wish = {"spp": spp, "seed": seed, "denoise": denoise, "out": out and str(out), "layers": layers}
        self.process.stdin.write(json.dumps(wish) + "\n")
        self.process.stdin.flush()
        return self.answer()["seconds"]

    def layers(self, spp, seed):
        """Before OIDN and after it, as six channels."""
        with tempfile.TemporaryDirectory() as place:
            file = Path(place, "a.exr")
            self.render(spp, seed, True, file, layers=True)
            return np.concatenate([layer(file, f"ViewLayer.{name}.") for name in ("Noisy Image", "Combined")], -1)

    def reference_spp(self):
        return self.a.cycles_reference_spp or self.a.reference_spp

    def reference(self, spp, seed):
        return kept(self.a.store / f"cycles-both-{spp}-{seed}.npy", lambda: self.layers(spp, seed))

    def measure_rates(self):
        """Processor seconds of a sample per pixel, of OIDN, and of what every render takes besides."""
        times = lambda *wish: sorted(self.render(*wish) for _ in range(3))[1]
        one, five, denoised = times(1, 901, False), times(5, 902, False), times(1, 903, True)
        self.sample = max((five - one) / 4, 1e-3)
        self.besides, self.denoiser = max(0.0, one - self.sample), max(0.0, denoised - one)

    def shown(self, budget, seed, _):
        spp = max(1, round((budget - self.denoiser) / self.sample))
        with tempfile.TemporaryDirectory() as place:
            file = Path(place, "a.exr")
            seconds = self.render(spp, seed, True, file)
            return displayed(main_layer(mi, str(file))), spp, seconds - self.besides

    def end(self):
        if self.process is not None:
            self.process.stdin.close()
            self.process.wait()


# Tables


@dataclass
class Row:
    scene: str
    variant: str
    seconds: float
    spp: float
    used: float
    flip: float
    delta_e: float
    against_denoised: float | None = None
    against_ours: float | None = None


def reference_of(renders, a):
    """The mean of the pictures, FLIP between the means of its halves, and the mean of the denoised pictures where there are some."""
    spp = renders.reference_spp()
    pictures = [renders.reference(spp, 1001 + i).astype(np.float64) for i in range(a.references)]
    halves, mean = [np.mean(pictures[i::2], axis=0)[..., :3] for i in (0, 1)], np.mean(pictures, axis=0)
    return mean[..., :3], flip(*map(displayed, halves)), mean[..., 3:]


def measure(a, scene):
    """Prints the rows of one scene; returns them and the pictures of the first time."""
    path = Path(scene)
    name = path.parent.name if path.stem == "scene" else path.stem
    a.store = a.root / "target" / "shown" / f"{name}-{hashlib.sha1(path.read_bytes()).hexdigest()[:8]}-{a.size[0]}x{a.size[1]}"
    a.store.mkdir(parents=True, exist_ok=True)
    cycles = Cycles(a, scene)
    try:
        return measure_both(a, name, Ours(a, scene), cycles)
    finally:
        cycles.end()


def measure_both(a, name, ours, cycles):
    """measure(), with the two programs at hand."""
    print(f"\n{name}: ours by {ours.method}", flush=True)
    reference, floor, _ = reference_of(ours, a)
    shown_reference, rows, pictures, floors = displayed(reference), [], {"reference": displayed(reference)}, {"ours": floor}
    samples = dict.fromkeys([ours.reference_spp()] + ([] if a.no_cycles else [cycles.reference_spp()]))
    about = f"references {a.references} x {' or '.join(map(str, samples))} samples per pixel; floor {floor:.4f} (ours)"
    theirs = None
    if not a.no_cycles:
        cycles.start()
        if cycles.why_not is None:
            theirs, floors["cycles"], clean = reference_of(cycles, a)
            ratio = theirs.mean((0, 1)) / reference.mean((0, 1))
            between = flip(shown_reference, displayed(theirs))
            about += f", {floors['cycles']:.4f} (Cycles); between references {between:.4f}, "
            about += f"brightness {' '.join(f'{r:.3f}' for r in ratio)}"
            pictures["Cycles' reference"] = displayed(theirs)
            floors |= {"references": between, "brightness": ratio.tolist()}
        else:
            about += f"; not by Cycles: {cycles.why_not}"
    print(about, flush=True)
    ours.measure_rates()
    about = f"ours: {ours.rate / 1e6:.2f} M paths/s, filter {ours.filter:.2f} s"
    variants = {f"ours {ours.method}{comma}{kind}": (ours, kind) for comma, kind in (("", ""), (", ", "display"), (", ", "wavelet"))}
    if theirs is not None:
        cycles.measure_rates()
        about += f"; Cycles: {cycles.sample:.2f} s per sample, OIDN {cycles.denoiser:.2f} s, besides {cycles.besides:.2f} s"
        variants[CYCLES] = (cycles, CYCLES)
    print(about + " (processor seconds)")
    print(f"{'':<30}{'time':>6}{'spp':>8}{'seconds':>9}{'FLIP':>9}{'ΔE':>8}{'denoised':>10}{'ours':>10}", flush=True)
    for variant, (renders, kind) in variants.items():
        is_cycles = kind == CYCLES
        for time in a.times:
            budget = time * a.cores
            made = [renders.shown(budget, seed, kind) for seed in range(a.rounds)]
            against = displayed(theirs) if is_cycles else shown_reference
            shown = [one[0] for one in made]
            mean = lambda f: float(np.mean([f(picture) for picture in shown]))
            used, error, colour = (float(np.mean([m[2] for m in made])), *(mean(lambda p: f(against, p)) for f in (flip, ciede2000)))
            row = Row(name, variant, time, made[0][1], used, error, colour)
            if is_cycles:
                row.against_denoised = mean(lambda p: flip(displayed(clean), p))
                row.against_ours = mean(lambda p: flip(shown_reference, p))
            rows.append(row)
            if time == a.times[0]:
                pictures[variant] = shown[0]
            noisy = "~" if floors["cycles" if is_cycles else "ours"] > FLOOR * row.flip else " "
            last = f"{row.against_denoised:>10.4f}{row.against_ours:>10.4f}" if is_cycles else ""
            print(f"{variant:<30}{time:>6g}{row.spp:>8.2f}{row.used:>9.2f}{row.flip:>8.4f}{noisy}{row.delta_e:>8.2f}{last}", flush=True)
    return rows, pictures, floors


def summary(rows, times):
    """FLIP at all times side by side, as Markdown."""
    heads = ["ours", "display", "wavelet", CYCLES, "against its denoised reference"]
    heads += ["wavelet / Cycles", "wavelet / that", "wavelet / display"]
    print(f"\nFLIP at {' / '.join(f'{t:g}' for t in times)} s\n\n| scene | {' | '.join(heads)} |\n{'|---' * (len(heads) + 1)}|")
    short = lambda x, digits: f"{x:.{digits}f}".removeprefix("0") if x < 1 else f"{x:.{digits}f}"
    for scene in dict.fromkeys(r.scene for r in rows):
        found = [[], [], [], [], []]
        for r in (r for r in rows if r.scene == scene):
            kind = r.variant.split(", ")[-1]
            found[heads.index(kind) if kind in heads else 0].append(r.flip)
            found[4] += [] if r.against_denoised is None else [r.against_denoised]
        ratios = [[p / q for p, q in zip(found[a], found[b])] for a, b in ((2, 3), (2, 4), (2, 1))]
        cells = [" / ".join(short(x, digits) for x in values) or "–" for digits, group in ((3, found), (2, ratios)) for values in group]
        print(f"| {scene} | {' | '.join(cells)} |")


def montage(a, name, pictures):
    """Ours without and with the filter, Cycles with OIDN, the reference; whole, and cut from the middle at full size."""
    order = sorted(pictures, key=lambda k: (k == "reference", k.startswith("Cycles"), "wavelet" in k))
    row = [pictures[k] for k in order if k != "Cycles' reference" and not k.endswith("display")]
    height, width = row[0].shape[:2]
    cut = lambda p: p[(height - CUT) // 2 :, (width - CUT) // 2 :][:CUT, :CUT]
    write_png(a.pictures / f"shown_{name}.png", np.concatenate(row, 1))
    write_png(a.pictures / f"shown_{name}_cut.png", np.concatenate([cut(p) for p in row], 1))
    for key, picture in pictures.items():
        if "eference" in key:
            write_png(a.pictures / f"shown_{name}_{'cycles_' if key.startswith('C') else ''}reference.png", picture)


def make_bigmesh(a):
    """The landscape is not in the repository: code makes it."""
    command = ["cargo", "run", "--release", "--locked", "--example", "make", "--", "meshes", "target/meshes"]
    print(f"{BIGMESH} is missing: {shlex.join(command)}", file=sys.stderr, flush=True)
    if subprocess.run(command, cwd=a.root, stdout=subprocess.DEVNULL).returncode != 0:
        raise Failed(f"{BIGMESH} could not be made")


def main():
    parser = argparse.ArgumentParser(prog="shown", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", nargs="*", help="Mitsuba 3 scene files (those of scenes/ and the landscape of 1.6 M triangles)")
    parser.add_argument("--root", type=Path, help=argparse.SUPPRESS)
    parser.add_argument("--program", help="the program (POINTILLIST, or target/release/pointillist)")
    parser.add_argument("--integrator", default="auto", metavar="NAME", help="of ours (auto)")
    parser.add_argument("--times", type=float, nargs="+", default=[1.0, 3.0, 10.0], help="seconds, of all threads at work (1 3 10)")
    parser.add_argument("--cores", type=int, default=2, help="processor seconds per second of --times (2)")
    parser.add_argument("--threads", type=int, help="threads of both programs (as --cores; 1 on a busy machine)")
    parser.add_argument("--rounds", type=int, default=1, help="pictures with other seeds to average over (1)")
    parser.add_argument("--references", type=int, default=4, help="pictures that make a reference (4, at least 2)")
    parser.add_argument("--reference-spp", type=int, default=256, help="samples per pixel of each of them (256)")
    parser.add_argument("--cycles-reference-spp", type=int, help="those of Cycles' (as --reference-spp)")
    parser.add_argument("--size", default="512x512", help="WxH of all pictures (512x512)")
    parser.add_argument("--no-cycles", action="store_true", help="ours only")
    parser.add_argument("--pictures", type=Path, metavar="DIR", help="folder for pictures of the first time side by side")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the figures here, too (target/shown/shown.json)")
    a = parser.parse_args()
    if a.references < 2:
        parser.error("--references: one picture does not tell its own noise")
    a.threads = a.threads or a.cores
    a.size = tuple(int(n) for n in a.size.lower().split("x"))
    a.root = (a.root or Path(__file__).resolve().parent.parent).resolve()
    a.program = a.program or os.environ.get("POINTILLIST") or str(a.root / "target" / "release" / "pointillist")
    if not os.path.exists(a.program):
        raise Failed(f"no program at {a.program}: cargo build --release, or --program")
    scenes = a.scene or [str(a.root / scene) for scene in SCENES]
    if not a.scene and not (a.root / BIGMESH).exists():
        make_bigmesh(a)
    if a.pictures:
        a.pictures.mkdir(parents=True, exist_ok=True)
    print(f"{a.size[0]} x {a.size[1]}, box filter, {a.threads} threads, {a.rounds} picture(s) each", flush=True)
    all_rows, failed, figures = [], 0, {}
    for scene in scenes:
        try:
            rows, pictures, floors = measure(a, scene)
        except (Failed, OSError) as e:
            print(f"shown: {scene}: {getattr(e, 'strerror', None) or e}", file=sys.stderr, flush=True)
            failed += 1
            continue
        all_rows += rows
        figures[rows[0].scene] = {"rows": [asdict(r) for r in rows]} | floors
        if a.pictures:
            montage(a, rows[0].scene, pictures)
    if not all_rows:
        sys.exit(2)
    summary(all_rows, a.times)
    out = a.json or a.root / "target" / "shown" / "shown.json"
    part = out.with_name(f".{out.name}.part")
    part.write_text(json.dumps(figures, indent=1) + "\n")
    os.replace(part, out)
    sys.exit(2 if failed else 0)


if __name__ == "__main__":
    try:
        main()
    except Failed as e:
        print(f"shown: {e}", file=sys.stderr)
        sys.exit(2)
