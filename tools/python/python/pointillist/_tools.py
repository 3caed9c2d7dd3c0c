"""Metrics of two pictures, and studies of what accuracy costs."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Optional, Union

from . import _native
from ._picture import Picture
from ._scene import _size, _words, Size

if TYPE_CHECKING:
    from ._picture import Array

Comparable = Union[Picture, str, "os.PathLike[str]", Any]
"""A picture, the path of an EXR file, or an array ``[height][width][3]`` of linear Rec.709."""


@dataclass(frozen=True)
class Metric:
    """A metric of a picture against its reference."""

    name: str
    value: float
    meaning: str
    details: Mapping[str, float]
    """Further values by name."""
    map: Array
    """The metric in every pixel, ``[height][width]``."""

    def __float__(self) -> float:
        return self.value


class Comparison(Mapping[str, Metric]):
    """Metrics by their names."""

    def __init__(self, metrics: Sequence[Metric]) -> None:
        """The metrics in their order."""
        self._metrics = {metric.name: metric for metric in metrics}

    def __getitem__(self, name: str) -> Metric:
        return self._metrics[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._metrics)

    def __len__(self) -> int:
        return len(self._metrics)

    def __repr__(self) -> str:
        return "\n".join(f"{m.name:9} {m.value:<12.4g} {m.meaning}" for m in self._metrics.values())


def _native_picture(given: Comparable) -> _native.Picture:
    if isinstance(given, Picture):
        return given._native
    if isinstance(given, (str, os.PathLike)):
        return _native.read(given)
    import numpy as np

    return _native.Picture.of_arrays(np.ascontiguousarray(given, dtype=np.float32), None)


def compare(
    picture: Comparable,
    reference: Comparable,
    metric: Union[str, Sequence[str], None] = None,
    *,
    exposure: Optional[float] = None,
) -> Comparison:
    """Compares a picture with a reference of the same size: pictures, EXR files or arrays.

    ``metric`` is one of ``relmse``, ``trimmed``, ``smape``, ``flip``, ``delta-e``, ``rse`` and ``z``, or several; without, all that the
    pictures allow (the last two need variances, which arrays do not have). ``exposure`` is the brightness that ``flip`` and ``delta-e`` see them with.

    >>> import pointillist
    >>> scene = pointillist.load(pointillist.cornell_box())
    >>> few, many = (scene.render(spp=spp, size=(32, 32), seed=spp) for spp in (2, 32))
    >>> metrics = pointillist.compare(few, many, ["flip", "relmse"])
    >>> 0 < float(metrics["flip"]) < 1
    True
    """
    names = [metric] if isinstance(metric, str) else list(metric or ())
    compared = _native.compare(_native_picture(picture), _native_picture(reference), names, exposure)
    return Comparison([_metric(json.loads(told), map_) for told, map_ in compared])


def _metric(told: Mapping[str, Any], map_: Array) -> Metric:
    def number(value: Optional[float]) -> float:
        # JSON has no infinity.
        return float("inf") if value is None else value

    details = {name: number(value) for name, value in told.get("details", {}).items()}
    return Metric(told["metric"], number(told["value"]), told["meaning"], details, map_)


def program() -> list[str]:
    """The words with which the program is started from Python."""
    return [sys.executable, "-m", "pointillist"]


def run(words: Sequence[str]) -> int:
    """Runs a subcommand in a process of its own, so that Ctrl-C and crashes are those of that process, and returns its exit code."""
    with subprocess.Popen([*program(), *words]) as process:
        while True:
            try:
                return process.wait()
            except KeyboardInterrupt:
                # The process has the signal of the terminal, too, and ends with what it has.
                continue


@dataclass(frozen=True)
class Study:
    """The outcome of a study."""

    folder: Path
    """Where its page ``index.html``, tables and charts are."""
    data: Mapping[str, Any]
    """``study.json``: scene, machine, and everything that was measured."""

    @property
    def page(self) -> Path:
        """The page, one file that needs no network."""
        return self.folder / "index.html"


def study(
    scene: Union[str, os.PathLike[str]],
    output: Union[str, os.PathLike[str], None] = None,
    *,
    budget: float = 120,
    size: Optional[Size] = None,
    device: Optional[str] = "cpu",
    quiet: bool = True,
    **options: Any,
) -> Study:
    """Measures what accuracy costs in time for a scene file: error against time of each method, and the cost of each effect and option.

    Takes ``budget`` seconds; a further study into the same folder adds to its measurements. Every other option of ``pointillist study`` is a
    keyword with underscores, such as ``methods=["path", "bidirectional"]``.
    """
    folder = Path(output) if output is not None else Path(f"study-{Path(scene).stem}")
    known = {"output": folder, "budget": budget, "size": _size(size), "device": device, "quiet": quiet}
    code = run(["study", *_words({**known, **options}), "--", os.fspath(scene)])
    if code != 0:
        raise _native.RenderError(f"the study of {os.fspath(scene)} has ended with exit code {code}; what it said is on standard error")
    return Study(folder, json.loads((folder / "study.json").read_text(encoding="utf-8")))
