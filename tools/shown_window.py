"""The window after a move of the camera, or from its first appearance: FLIP of what is on the screen against the converged picture.

The viewer runs on a display of its own (Xvfb), 512 x 512 without the panel. A synthetic mouse turns the camera around its target by
--angle degrees, there and back in turn; the screen is read at fixed times after the pointer moved. The reference is a render of the
command that the viewer itself prints for the view (key C), with the same display settings, many samples and no noise filter; it is
kept in target/shown/window. The exposure is fixed, unless a variant says otherwise, so that all pictures have one. FLIP of a round is
averaged over the rounds, with the standard error beside it.

A variant is a set of options for `pointillist view`: --variant "--denoise off" --variant "--integrator auto", or for a single word
--variant=--deterministic. Variants are measured one after the other, all rounds of moves in one window each. A move that the window
missed is repeated. --steering compares the window with and without steered samples: two variants, measured in turns --turns times, and
the ratio of their FLIP.
"""

import argparse
import hashlib
import os
import queue
import shlex
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

import mitsuba as mi
import numpy as np
from Xlib import X, XK, display, error
from Xlib.ext import xtest

from mitsuba_scene import Failed
from shown import ciede2000, flip, write_png

# Options of the printed command that the reference replaces.
REPLACED = {"--samples", "--spp", "--seed", "--denoise", "--device", "--integrator", "--threads", "-o"}
# Room around the window, so that all of it is on the screen.
MARGIN = 64
# Longest wait for the window, and for the answer to a key, seconds.
PATIENCE = 60
# How long the viewer shows its message about the printed command, with a margin, seconds.
MESSAGE = 6.0


class Desktop:
    """An X server without a screen."""

    def __init__(self, size):
        read, write = os.pipe()
        screen = "x".join(map(str, [n + MARGIN for n in size] + [24]))
        command = ["Xvfb", "-displayfd", str(write), "-screen", "0", screen, "-nolisten", "tcp", "-noreset"]
        try:
            self.server = subprocess.Popen(command, pass_fds=[write], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        except FileNotFoundError:
            raise Failed("no Xvfb; on Debian: apt-get install xvfb") from None
        os.close(write)
        with os.fdopen(read) as answer:
            number = answer.readline().strip()
        if not number:
            raise Failed("Xvfb did not start")
        self.name = f":{number}"
        self.display = display.Display(self.name)
        self.root = self.display.screen().root

    def window(self, process, deadline):
        """The viewer's window, once it is mapped."""
        while time.monotonic() < deadline:
            if process.poll() is not None:
                raise Failed("the viewer ended")
            for child in self.root.query_tree().children:
                if "ointillist" in (child.get_wm_name() or "") and child.get_attributes().map_state == X.IsViewable:
                    return child
            time.sleep(0.002)
        raise Failed(f"no window within {PATIENCE} s")

    def pointer(self, x, y):
        xtest.fake_input(self.display, X.MotionNotify, x=x, y=y)
        self.display.sync()

    def button(self, down):
        xtest.fake_input(self.display, X.ButtonPress if down else X.ButtonRelease, 1)
        self.display.sync()

    def key(self, letter):
        code = self.display.keysym_to_keycode(XK.string_to_keysym(letter))
        for kind in (X.KeyPress, X.KeyRelease):
            xtest.fake_input(self.display, kind, code)
        self.display.sync()

    def end(self):
        self.display.close()
        self.server.terminate()
        self.server.wait()


class Viewer:
    """`pointillist view` in its own desktop."""

    def __init__(self, a, scene, options, place):
        self.a, self.desktop = a, Desktop(a.size)
        exposure = [] if "--exposure" in options else ["--exposure", "1"]
        command = [a.program, "view", scene, "--no-panel", "--size", "x".join(map(str, a.size)), *exposure, *options]
        environment = {k: v for k, v in os.environ.items() if k != "WAYLAND_DISPLAY"} | {"DISPLAY": self.desktop.name}
        self.start = time.monotonic()
        self.log = open(Path(place, "view.log"), "w+")
        self.process = subprocess.Popen(command, cwd=place, env=environment, stdout=subprocess.PIPE, stderr=self.log, text=True)
        self.lines = queue.Queue()
        threading.Thread(target=lambda: [self.lines.put(line) for line in self.process.stdout], daemon=True).start()
        try:
            self.window = self.desktop.window(self.process, self.start + PATIENCE)
        except Failed as e:
            self.end()
            self.log.seek(0)
            raise Failed(f"{e}: {' '.join(self.log.read().split())[:300]}") from None
        self.mapped = time.monotonic()
        self.window.configure(x=0, y=0)
        self.window.set_input_focus(X.RevertToParent, X.CurrentTime)
        self.desktop.display.sync()

    def pixels(self):
        """What the screen shows, encoded, in [0, 1]."""
        size = self.window.get_geometry()
        image = self.window.get_image(0, 0, size.width, size.height, X.ZPixmap, 0xFFFFFFFF)
        data = np.frombuffer(image.data, dtype=np.uint8).reshape(size.height, size.width, 4)
        return data[..., 2::-1]

    def watch(self, start):
        """Pictures at the times after `start`, and when each was read."""
        made = []
        for after in self.a.times:
            time.sleep(max(0.0, start + after - time.monotonic()))
            made.append((self.pixels(), time.monotonic() - start))
        return made

    def turn(self, by):
        """Drags the camera by so many pixels; returns when the pointer moved."""
        x, y = self.a.size[0] // 2, self.a.size[1] * 3 // 4
        self.desktop.pointer(x, y)
        self.desktop.button(True)
        time.sleep(0.02)
        self.desktop.pointer(x + by, y)
        start = time.monotonic()
        time.sleep(0.02)
        self.desktop.button(False)
        return start

    def command(self):
        """The words of the command that repeats this view, without the program and `render`."""
        while not self.lines.empty():
            self.lines.get()
        self.desktop.key("c")
        try:
            while True:
                words = shlex.split(self.lines.get(timeout=PATIENCE))
                if "render" in words:
                    return words[words.index("render") + 1 :]
        except queue.Empty:
            raise Failed("the viewer printed no command at the key C") from None

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.end()

    def end(self):
        self.process.terminate()
        self.process.wait()
        self.desktop.end()


def reference(a, place, words):
    """The converged picture of a command, encoded."""
    scene, rest, skip = Path(place, words[0]), [], False
    for word in words[1:]:
        if skip or word in REPLACED:
            skip = not skip
            continue
        if word != "--deterministic":
            rest.append(word)
    rest += ["--integrator", a.reference_integrator, "--spp", str(a.reference_spp), "--seed", "7", "--denoise", "off", "--device", "cpu"]
    key = hashlib.sha1(shlex.join(rest).encode() + scene.read_bytes()).hexdigest()[:12]
    file = a.root / "target" / "shown" / "window" / f"{key}.png"
    if not file.exists():
        file.parent.mkdir(parents=True, exist_ok=True)
        part = file.with_name(f".{key}.part.png")
        command = [a.program, "render", str(scene), *rest, "--quiet", "-o", str(part)]
        print(f"shown: rendering the reference, {a.reference_spp} samples per pixel; it is kept", file=sys.stderr)
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode != 0:
            raise Failed(f"{shlex.join(command)} failed: {' '.join(done.stderr.split())[:300]}")
        os.replace(part, file)
    return np.array(mi.Bitmap(str(file)))[..., :3] / 255.0


def moves(a, viewer):
    """Rounds of moves there and back: whether there, the pictures, 0; and the commands of both views."""
    by, rounds, views, before = round(a.angle / 180 * a.size[0]), [], {}, {}
    time.sleep(a.wait)
    for there in (True, False):
        viewer.turn(by if there else -by)
        time.sleep(1)
        before[there] = viewer.pixels() / 255.0
        views[there] = viewer.command()
        time.sleep(MESSAGE)
    time.sleep(a.wait)
    for _ in range(2 * a.rounds):
        there = len(rounds) % 2 == 0
        made = viewer.watch(viewer.turn(by if there else -by))
        last = made[-1][0] / 255.0
        if flip(before[there], last) <= flip(before[not there], last):
            rounds.append((there, made, 0.0))
        if len(rounds) == a.rounds:
            return rounds, views
    raise Failed("the window missed most moves")


def measure(a, scene, options):
    """FLIP and CIEDE2000 by round and time, when the pictures were read, and pictures of one round."""
    rounds, views = [], {}
    with tempfile.TemporaryDirectory() as place:
        if a.from_start:
            for _ in range(a.rounds):
                with Viewer(a, scene, options, place) as viewer:
                    rounds.append((False, viewer.watch(viewer.mapped), viewer.mapped - viewer.start))
                    # All start with the same view.
                    views = views or {False: viewer.command()}
        else:
            with Viewer(a, scene, options, place) as viewer:
                rounds, views = moves(a, viewer)
        converged = {view: reference(a, place, words) for view, words in views.items()}
    if rounds[0][1][0][0].shape != next(iter(converged.values())).shape:
        raise Failed(f"the window shows {rounds[0][1][0][0].shape}, not a picture of {a.size}")
    errors = np.array([[[f(converged[v], p / 255.0) for p, _ in made] for v, made, _ in rounds] for f in (flip, ciede2000)])
    read = np.mean([[at for _, at in made] for _, made, _ in rounds], 0)
    view, made, _ = rounds[0]
    return errors, read, np.mean([r[2] for r in rounds]), [p / 255.0 for p, _ in made] + [converged[view]]


def main():
    parser = argparse.ArgumentParser(prog="shown --window", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", nargs="*", help="scene files (scenes/cornell.xml)")
    parser.add_argument("--window", action="store_true", help="measure the window")
    parser.add_argument("--from-start", action="store_true", help="from the first appearance of the window instead of a move")
    parser.add_argument("--variant", action="append", metavar="OPTIONS", help="of `view`, in one word (nothing, and --denoise off)")
    parser.add_argument("--steering", action="store_true", help="compare with and without steered samples (view --steer)")
    parser.add_argument("--turns", type=int, default=1, help="times that every variant is measured, in turns (1)")
    parser.add_argument("--times", type=float, nargs="+", default=[0.033, 0.1, 0.33, 1.0, 3.0, 10.0], help="seconds (.033 .1 .33 1 3 10)")
    parser.add_argument("--rounds", type=int, default=4, help="moves, or starts (4)")
    parser.add_argument("--angle", type=float, default=10.0, help="degrees (10)")
    parser.add_argument("--wait", type=float, default=3.0, help="seconds before the first move (3)")
    parser.add_argument("--reference-spp", type=int, default=256, help="samples per pixel of the converged picture (256)")
    parser.add_argument("--reference-integrator", default="bidirectional", metavar="NAME", help="its method (bidirectional)")
    parser.add_argument("--size", default="512x512", help="WxH of the picture (512x512)")
    parser.add_argument("--pictures", type=Path, metavar="DIR", help="folder for what the screen showed, time by time, and the reference")
    parser.add_argument("--program", help="the program (POINTILLIST, or target/release/pointillist)")
    parser.add_argument("--root", type=Path, help=argparse.SUPPRESS)
    a = parser.parse_args()
    a.size = tuple(int(n) for n in a.size.lower().split("x"))
    a.root = (a.root or Path(__file__).resolve().parent.parent).resolve()
    a.program = os.path.abspath(a.program or os.environ.get("POINTILLIST") or a.root / "target" / "release" / "pointillist")
    if not os.path.exists(a.program):
        raise Failed(f"no program at {a.program}: cargo build --release, or --program")
    if a.steering and (a.variant or a.from_start):
        parser.error("--steering has variants of its own, and needs moves: leave --variant and --from-start away")
    variants = ["--steer", ""] if a.steering else ["", "--denoise off"] if a.variant is None else a.variant
    what = "its appearance" if a.from_start else f"a move of {round(a.angle / 180 * a.size[0]) * 180 / a.size[0]:.1f} degrees"
    for scene in a.scene or [str(a.root / "scenes/cornell.xml")]:
        print(f"{scene}: FLIP of the window after {what}, {a.rounds} rounds (standard error); CIEDE2000 in the second row")
        print(f"{'seconds':<36}" + "".join(f"{t:>16g}" for t in a.times), flush=True)
        flips = [[] for _ in variants]
        for number, variant in list(enumerate(variants)) * a.turns:
            errors, read, appeared, pictures = measure(a, os.path.abspath(scene), shlex.split(variant))
            flips[number] += list(errors[0])
            for kind, values in enumerate(errors):
                cells = "".join(f"{m:>8.{3 - kind}f} ({s:.{3 - kind}f})" for m, s in zip(*mean_and_error(values)))
                print(f"{(variant or 'as it comes') if kind == 0 else '':<36}{cells}", flush=True)
            late = f", which appeared after {appeared:.2f} s" if a.from_start else ""
            print(f"  read after {' '.join(f'{t:.3f}' for t in read)} s{late}", flush=True)
            if a.pictures:
                a.pictures.mkdir(parents=True, exist_ok=True)
                kind = "start" if a.from_start else "move"
                write_png(a.pictures / f"window_{Path(scene).stem}_{kind}_{number}.png", np.concatenate(pictures, 1))
        if a.steering:
            (steered, spread), (even, spread_of_even) = (mean_and_error(np.array(values)) for values in flips)
            ratio = steered / even
            error_of_ratio = ratio * np.hypot(spread / steered, spread_of_even / even)
            cells = "".join(f"{r:>8.3f} ({e:.3f})" for r, e in zip(ratio, error_of_ratio))
            print(f"{'FLIP, steered over even':<36}{cells}", flush=True)


def mean_and_error(values):
    """Mean of the rounds, and its standard error; 0 for one round."""
    spread = values.std(0, ddof=1) / len(values) ** 0.5 if len(values) > 1 else 0 * values[0]
    return values.mean(0), spread


if __name__ == "__main__":
    try:
        main()
    except (Failed, error.ConnectionClosedError) as e:
        print(f"shown: {e}", file=sys.stderr)
        sys.exit(2)
