"""Regression renders from Python."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import pointillist

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
    assert same.is_green and same.report
    scene.write_text(SCENE.replace("0.5, 0.5, 0.5", "0.9, 0.9, 0.9"), encoding="utf-8")
    changed = pointillist.regress.run(tmp_path, device="cpu")
    assert changed.code == 1 and not changed.is_green
