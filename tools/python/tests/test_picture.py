"""Renders and pictures: arrays, shared memory, errors, files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import pointillist
from conftest import SMALL


def test_three_lines(root: Path) -> None:
    """The example at the top of the README, of a smaller picture."""
    picture = pointillist.load(root / "scenes" / "cornell.xml").render(spp=2, size=(32, 32))
    array = picture["picture"]
    assert array.shape == (32, 32, 3) and array.dtype == np.float32 and array.max() > 0


def test_arrays_have_names(scene: pointillist.Scene) -> None:
    picture = scene.render(**SMALL, aovs=["depth", "n:sh_normal"], light_groups={"top": "lamp"})
    shapes = {name: array.shape for name, array in picture.items()}
    assert shapes["picture"] == shapes["top"] == shapes["n"] == (16, 24, 3)
    assert shapes["variance"] == shapes["depth"] == (16, 24)
    assert shapes["camera"] == (16, 24, 4)
    assert np.array_equal(picture["G"], picture["picture"][..., 1])
    assert np.linalg.norm(picture["n"], axis=-1).max() == pytest.approx(1, abs=0.01)
    # The only lamp has made the whole picture.
    assert np.allclose(picture["top"], picture["picture"], atol=1e-6)
    with pytest.raises(KeyError):
        picture["no such array"]


def test_nothing_is_copied(scene: pointillist.Scene) -> None:
    picture = scene.render(**SMALL)
    array = picture["picture"]
    assert picture["picture"] is array
    assert np.shares_memory(np.asarray(picture), array)
    assert np.shares_memory(np.frombuffer(array, dtype=np.float32), array)
    assert np.shares_memory(np.from_dlpack(picture), array)
    assert array.flags.c_contiguous and array.flags.writeable and not np.array(picture, copy=True) is array
    assert np.asarray(picture, dtype=np.float64).dtype == np.float64


def test_torch_shares_the_memory(scene: pointillist.Scene) -> None:
    torch = pytest.importorskip("torch")
    picture = scene.render(**SMALL)
    tensor = torch.from_dlpack(picture)
    tensor[0, 0, 0] = 7.0
    assert picture["picture"][0, 0, 0] == 7.0


def test_arrays_outlive_their_picture(scene: pointillist.Scene) -> None:
    array = scene.render(**SMALL)["picture"]
    copy = array.copy()
    del scene
    assert np.array_equal(array, copy)


def test_the_error_is_stated(scene: pointillist.Scene) -> None:
    few, many = (scene.render(spp=spp, size=(32, 32)) for spp in (8, 128))
    assert few.error is not None and many.error is not None
    low, value, high = few.error.p95.low, few.error.p95.value, few.error.p95.high
    assert 0 < low < value < high
    assert many.error.p95.value < value
    assert f"{many.error.p95:.1%}".count("%") == 3
    assert scene.render(**SMALL, replicates=1).error is None
    assert few.report["samples_per_pixel"] == pytest.approx(8, rel=0.1)


def test_renders_end_at_an_error(scene: pointillist.Scene) -> None:
    picture = scene.render(error="20%", time=60, size=(32, 32))
    assert picture.report["error"]["reached"] and picture.report["error"]["target"] == pytest.approx(0.2)


def test_options_are_those_of_the_command_line(scene: pointillist.Scene) -> None:
    picture = scene.render(**SMALL, max_depth=2, threads=1, method="bidirectional", denoise="wavelet")
    assert picture["denoised"].shape == (16, 24, 3)
    assert picture.report["integrator"] == "bidirectional" and picture.report["threads"] == 1
    with pytest.raises(ValueError, match="--no-such"):
        scene.render(no_such=1)
    with pytest.raises(ValueError, match="many"):
        scene.render(spp="many")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="output"):
        scene.render(output="picture.exr")
    with pytest.raises(pointillist.RenderError):
        scene.render(spp=1, device="no such device")


def test_two_eyes_are_two_arrays(scene: pointillist.Scene) -> None:
    picture = scene.render(**SMALL, stereo=True)
    assert picture["picture"].shape == picture["right"].shape == (16, 24, 3)
    assert not np.array_equal(picture["picture"], picture["right"])


def test_threads_change_no_bit(scene: pointillist.Scene) -> None:
    one, two = (scene.render(**SMALL, threads=threads)["picture"] for threads in (1, 3))
    other = scene.render(**SMALL, seed=1)["picture"]
    assert np.array_equal(one, two) and not np.array_equal(one, other)


def test_files_have_everything(scene: pointillist.Scene, tmp_path: Path) -> None:
    picture = scene.render(**SMALL, aovs="depth")
    picture.save(tmp_path / "picture.exr")
    read = pointillist.read(tmp_path / "picture.exr")
    assert set(read) == set(picture)
    assert all(np.array_equal(read[name], picture[name], equal_nan=True) for name in read)
    assert read.attributes["integrator"] == "path" and read.error is None
    picture.save(tmp_path / "picture.png")
    assert (tmp_path / "picture.png").read_bytes() == picture._repr_png_()
    with pytest.raises(ValueError, match="picture.jpg"):
        picture.save(tmp_path / "picture.jpg")
    with pytest.raises(OSError, match="there"):
        picture.save(tmp_path / "there" / "is" / "no.exr")
    with pytest.raises(OSError):
        pointillist.read(tmp_path / "no.exr")


def test_only_a_file_as_it_is_has_a_command(root: Path) -> None:
    """The command that repeats a render is that of the command line, which knows nothing of changes in Python."""
    file = root / "scenes" / "cornell.xml"
    scene = pointillist.load(file)
    assert str(file) in str(scene.render(**SMALL).attributes["command"])
    for other in (scene.edit({"white.reflectance": [0.5, 0.5, 0.5]}), pointillist.load(file, max_depth=3)):
        assert "command" not in other.render(**SMALL).attributes


def test_metrics_have_values_and_maps(scene: pointillist.Scene, tmp_path: Path) -> None:
    picture, reference = scene.render(**SMALL), scene.render(**{**SMALL, "spp": 64, "seed": 1})
    reference.save(tmp_path / "reference.exr")
    metrics = pointillist.compare(picture, tmp_path / "reference.exr")
    assert {"relmse", "flip", "delta-e", "z"} <= set(metrics)
    assert metrics["flip"].map.shape == (16, 24)
    assert metrics["flip"].map.mean() == pytest.approx(metrics["flip"].value, rel=1e-3)
    same = pointillist.compare(picture["picture"], picture, "relmse")
    assert list(same) == ["relmse"] and float(same["relmse"]) == 0
    with pytest.raises(ValueError, match="no-metric"):
        pointillist.compare(picture, reference, "no-metric")
    with pytest.raises(ValueError, match="cannot be measured"):
        pointillist.compare(picture["picture"], reference, "z")
    with pytest.raises(ValueError, match="cannot be compared"):
        pointillist.compare(picture, scene.render(spp=1, size=(8, 8)))
