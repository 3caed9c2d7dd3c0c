"""The package: types, import time, the program, studies, examples."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

import pointillist

HERE = Path(__file__).resolve().parents[1]


def test_the_types_are_strict() -> None:
    pytest.importorskip("mypy")
    checked = subprocess.run(
        [sys.executable, "-m", "mypy", "--strict", "--no-incremental"], cwd=HERE, capture_output=True, text=True, check=False
    )
    assert checked.returncode == 0, checked.stdout + checked.stderr


def test_the_stubs_are_those_of_the_native_half() -> None:
    pytest.importorskip("mypy")
    tested = subprocess.run(
        [sys.executable, "-m", "mypy.stubtest", "pointillist._native", "--ignore-missing-stub", "--ignore-disjoint-bases"],
        cwd=HERE,
        capture_output=True,
        text=True,
        check=False,
    )
    assert tested.returncode == 0, tested.stdout + tested.stderr


def test_an_import_does_not_load_numpy() -> None:
    """NumPy takes most of the time of an import; it is loaded with the first array."""
    script = "import sys, pointillist; sys.exit('numpy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", script], check=False).returncode == 0


def test_everything_public_is_documented() -> None:
    for name in pointillist.__all__:
        assert getattr(getattr(pointillist, name), "__doc__", None), name


def test_the_program_is_there() -> None:
    run = [sys.executable, "-m", "pointillist"]
    listed = subprocess.run([*run, "plugins", "shape"], capture_output=True, text=True, check=False)
    assert listed.returncode == 0 and "sphere" in listed.stdout
    assert subprocess.run([*run, "no-such-command"], capture_output=True, check=False).returncode == 2


def test_a_study_has_a_page(root: Path, tmp_path: Path) -> None:
    scene = root / "scenes" / "cornell.xml"
    study = pointillist.study(scene, tmp_path / "study", budget=6, size=(32, 32), knobs=["methods"], methods=["path"])
    assert study.page.exists() and json.dumps(dict(study.data))
    with pytest.raises(pointillist.RenderError, match="exit code"):
        pointillist.study("there/is/no.xml", tmp_path / "none", budget=1)


def test_the_example_runs(tmp_path: Path) -> None:
    example = HERE / "examples" / "accuracy.py"
    ran = subprocess.run(
        [sys.executable, str(example), "--seconds", "3"], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert ran.returncode == 0, ran.stderr
    assert "1 %" in ran.stdout
