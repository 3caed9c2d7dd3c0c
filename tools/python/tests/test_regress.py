"""Regression renders from Python."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

import pointillist
from pointillist import _native

SCENE = """<scene version="3.0.0">
  <sensor type="perspective"><film type="hdrfilm"><integer name="width" value="16"/><integer name="height" value="16"/></film></sensor>
  <shape type="sphere"><point name="center" value="0, 0, 4"/>
    <bsdf type="diffuse"><rgb name="reflectance" value="0.5, 0.5, 0.5"/></bsdf></shape>
  <emitter type="constant"/>
</scene>
"""


def has_regress() -> bool:
    """Whether the program has the subcommand."""
    words = [sys.executable, "-m", "pointillist", "regress", "--help"]
    return subprocess.run(words, capture_output=True, check=False).returncode == 0


@pytest.mark.skipif(not has_regress(), reason="this program has no `regress`")
def test_runs_are_green_until_something_changes(tmp_path: Path) -> None:
    scene = tmp_path / "ball.xml"
    scene.write_text(SCENE, encoding="utf-8")
    pointillist.regress.update(tmp_path, reason="the first references", device="cpu")
    same = pointillist.regress.run(tmp_path, device="cpu")
    assert same.is_green and same.report["cases"][0]["verdict"] == "same-bits"
    others = pointillist.regress.run(tmp_path, device="cpu", seed_base=5000)
    assert others.is_green and others.report["cases"][0]["verdict"] == "equal-within-noise"
    scene.write_text(SCENE.replace("0.5, 0.5, 0.5", "0.9, 0.9, 0.9"), encoding="utf-8")
    changed = pointillist.regress.run(tmp_path, device="cpu")
    assert changed.code == 1 and not changed.is_green


@pytest.mark.skipif(not has_regress(), reason="this program has no `regress`")
def test_results_depend_on_the_native_library(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "ball.xml").write_text(SCENE, encoding="utf-8")
    (tmp_path / "regress.toml").write_text('[[case]]\nscene = "ball.xml"\nseeds = 2\nmost_seeds = 2\nspp = 1\n', encoding="utf-8")
    pointillist.regress.update(tmp_path, reason="the first references", device="cpu")

    def program() -> str:
        assert pointillist.regress.run(tmp_path, device="cpu").is_green
        finished = json.loads((tmp_path / "results" / "ball.json").read_text(encoding="utf-8"))
        return str(finished["key"]["program"])

    monkeypatch.delenv("POINTILLIST_LIBRARY", raising=False)
    usual = program()
    monkeypatch.setenv("POINTILLIST_LIBRARY", str(_native.__file__))
    assert program() == usual
    # As if the library had been built anew.
    built = tmp_path / "built"
    built.write_bytes(Path(str(_native.__file__)).read_bytes() + b"anew")
    monkeypatch.setenv("POINTILLIST_LIBRARY", str(built))
    assert program() != usual
