"""What the tests share."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import pointillist

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture
def root() -> Path:
    """The folder of the repository."""
    return ROOT


@pytest.fixture
def box() -> dict[str, Any]:
    """The demonstration scene as a dictionary."""
    return pointillist.cornell_box()


@pytest.fixture
def scene(box: dict[str, Any]) -> pointillist.Scene:
    """The demonstration scene."""
    return pointillist.load(box)


SMALL = {"spp": 4, "size": (24, 16), "deterministic": True}
"""Options of a small render whose bits are those of every other one."""
