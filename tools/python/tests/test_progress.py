"""Progress, pictures on the way, and Ctrl-C."""

from __future__ import annotations

import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

import pointillist


def test_progress_is_told(scene: pointillist.Scene) -> None:
    moments: list[pointillist.Moment] = []
    scene.render(time=0.6, size=(32, 32), progress=moments.append)
    assert len(moments) >= 3
    shares = [moment.share for moment in moments]
    assert shares == sorted(shares) and 0 <= shares[0] and shares[-1] <= 1
    assert moments[-1].samples_per_pixel > 0


def test_an_exception_of_the_progress_ends_the_render(scene: pointillist.Scene) -> None:
    class Enough(Exception):
        pass

    def watch(moment: pointillist.Moment) -> None:
        raise Enough

    start = time.monotonic()
    with pytest.raises(Enough):
        scene.render(time=600, size=(32, 32), progress=watch)
    assert time.monotonic() - start < 60


def test_the_bar_goes_to_standard_error(scene: pointillist.Scene, capfd: pytest.CaptureFixture[str]) -> None:
    scene.render(time=0.2, size=(16, 16), progress=True)
    out, err = capfd.readouterr()
    assert out == "" and "samples per pixel" in err


def test_other_threads_run_meanwhile(scene: pointillist.Scene) -> None:
    counts = [0]
    stop = threading.Event()

    def count() -> None:
        while not stop.is_set():
            counts[0] += 1
            time.sleep(0.001)

    thread = threading.Thread(target=count)
    thread.start()
    before = counts[0]
    scene.render(time=0.5, size=(32, 32), threads=1)
    during = counts[0] - before
    stop.set()
    thread.join()
    assert during > 20


def test_two_threads_render_at_once(scene: pointillist.Scene) -> None:
    options = {"spp": 8, "size": (24, 16), "deterministic": True, "threads": 1}
    alone = scene.render(**options)["picture"]
    pictures: list[np.ndarray] = []
    threads = [threading.Thread(target=lambda: pictures.append(scene.render(**options)["picture"])) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(pictures) == 2 and all(np.array_equal(picture, alone) for picture in pictures)


def test_pictures_come_on_the_way(scene: pointillist.Scene) -> None:
    pictures = scene.progressive(time=1.0, size=(32, 32), every=0.1, light_groups=True)
    seen = []
    for picture in pictures:
        seen.append((pictures.moment, picture))
    assert len(seen) >= 2
    assert all(moment is not None for moment, _ in seen[:-1]) and seen[-1][0] is None
    assert all(picture["picture"].max() > 0 for _, picture in seen)
    last = seen[-1][1]
    assert last.error is not None and last["lamp"].shape == (32, 32, 3)


def test_the_last_picture_is_that_of_a_render(scene: pointillist.Scene) -> None:
    options = {"spp": 32, "size": (24, 16), "deterministic": True}
    *_, last = scene.progressive(every=0.0, **options)
    assert np.array_equal(last["picture"], scene.render(**options)["picture"])


def test_a_render_ends_with_its_loop(scene: pointillist.Scene) -> None:
    before = threading.active_count()
    start = time.monotonic()
    with scene.progressive(time=600, size=(32, 32), every=0.01) as pictures:
        first = next(pictures)
    assert first["picture"].shape == (32, 32, 3)
    # After it is closed there is at most what was waiting, and the last picture.
    assert len(list(pictures)) <= 2
    assert time.monotonic() - start < 60 and threading.active_count() == before


def test_errors_of_renders_on_threads_are_raised(scene: pointillist.Scene) -> None:
    with pytest.raises(pointillist.RenderError):
        list(scene.progressive(spp=1, device="no such device"))
    with pytest.raises(ValueError, match="every"):
        scene.progressive(spp=1, every=-1.0)


INTERRUPTED = """
import pointillist, signal, sys
# A process in the background may have been started without it.
signal.signal(signal.SIGINT, signal.default_int_handler)
scene = pointillist.load(pointillist.cornell_box())
try:
    {render}
except KeyboardInterrupt:
    # Python goes on, and so does the renderer.
    assert scene.render(spp=1, size=(8, 8))["picture"].shape == (8, 8, 3)
    sys.exit(7)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="signals are those of Unix")
@pytest.mark.parametrize(
    "render",
    [
        "scene.render(time=600, size=(64, 64), progress=lambda m: print('begun', flush=True))",
        "print('begun', flush=True); list(scene.progressive(time=600, size=(64, 64), every=100))",
    ],
)
def test_ctrl_c_is_a_keyboard_interrupt(render: str) -> None:
    script = INTERRUPTED.format(render=render)
    with subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None and process.stdout.readline() == "begun\n"
        time.sleep(0.3)
        process.send_signal(signal.SIGINT)
        process.stdout.read()
        assert process.wait(timeout=120) == 7


def resident() -> int:
    """Bytes of memory in use."""
    pages = Path("/proc/self/statm").read_text(encoding="ascii").split()[1]
    return int(pages) * 4096


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="the memory is known on Linux")
def test_memory_does_not_grow(scene: pointillist.Scene) -> None:
    """300 renders after 100; `benchmarks/growth.py` makes 10⁴."""

    def renders(count: int) -> int:
        for _ in range(count):
            scene.render(spp=1, size=(8, 8), threads=1)["picture"]
        return resident()

    before = renders(100)
    assert renders(300) - before < 8 << 20
