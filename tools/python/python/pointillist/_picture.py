"""Pictures: arrays by name, the stated error, and how they are shown and saved."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple, Optional, Union

from . import _native

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

    Array = npt.NDArray[np.float32]


class ErrorInterval(NamedTuple):
    """A number with its 90 % confidence interval."""

    value: float
    low: float
    high: float

    def __format__(self, spec: str) -> str:
        """The value and in brackets the interval, each by the format, such as ``.1%``."""
        spec = spec or ".3g"
        return f"{self.value:{spec}} ({self.low:{spec}}–{self.high:{spec}})"

    @classmethod
    def of(cls, numbers: Mapping[str, Optional[float]]) -> ErrorInterval:
        """From a report, where what is not finite is null."""
        known = (numbers.get(name) for name in cls._fields)
        return cls(*(math.nan if number is None else float(number) for number in known))


class StatedError(NamedTuple):
    """The error of a picture, known without a reference from two independent halves of its samples.

    ``median``, ``p95`` and ``p99`` are relative errors that 50, 95 and 99 % of the picture stay below, and ``rel_mse`` is the mean
    of the squared error over the squared luminance plus 0.01, each with its 90 % interval.
    """

    median: ErrorInterval
    p95: ErrorInterval
    p99: ErrorInterval
    rel_mse: ErrorInterval
    warning: Optional[str]
    """Why it may be too small, if light is still being found."""

    @classmethod
    def of(cls, report: Mapping[str, Any]) -> StatedError:
        """From the report of a render."""
        told = [report[name] for name in ("unfound", "warning") if report.get(name)]
        median, p95, p99, rel_mse = (ErrorInterval.of(report[name]) for name in ("median", "p95", "p99", "rel_mse"))
        return cls(median, p95, p99, rel_mse, "; ".join(told) or None)


# The order of the channels of an array; files have them by the alphabet.
_ORDER = "RGBXYZWUVTIxA"


def _layers(channels: list[str]) -> dict[str, list[str]]:
    """The channels of each array by its name."""
    layers: dict[str, list[str]] = {}
    for channel in channels:
        layer, _, last = channel.rpartition(".")
        if layer.rpartition(".")[2] == "variance":
            # The variance of the picture, and what the films of its streams have summed up.
            layers[layer if last == "Y" else channel] = [channel]
        else:
            layers.setdefault(layer or "picture", []).append(channel)
    for members in layers.values():
        members.sort(key=lambda channel: _ORDER.find(channel.rpartition(".")[2]) % 99)
    return layers


class Picture(Mapping[str, "Array"]):
    """A picture: a mapping from names to arrays of 32-bit floats ``[height][width]`` or ``[height][width][channel]``.

    >>> import pointillist
    >>> picture = pointillist.load(pointillist.cornell_box()).render(spp=8, size=(24, 16), aovs=["depth"])
    >>> picture["picture"].shape, picture["variance"].shape, picture["depth"].shape
    ((16, 24, 3), (16, 24), (16, 24))

    ``picture`` is linear Rec.709; ``variance`` is the variance of the mean luminance; ``camera`` and ``light`` are the sums of X, Y, Z and
    weight of both streams of samples. Layers (``aovs``) and light groups have their own names. Names of single channels, such as ``"R"``,
    are accepted, too.

    An array is made once. NumPy and what reads buffers or DLPack share its memory:

    >>> import numpy
    >>> numpy.shares_memory(numpy.asarray(picture), picture["picture"])
    True
    """

    def __init__(self, native: _native.Picture) -> None:
        """Wraps what the renderer has made; users get pictures from renders and :func:`read`."""
        self._native = native
        self._layers = _layers(native.channels)
        self._arrays: dict[str, Array] = {}
        self._report: Optional[dict[str, Any]] = json.loads(native.report)

    def __getitem__(self, name: str) -> Array:
        if name not in self._arrays:
            channels = self._layers.get(name, [name])
            single = len(channels) == 1
            make = self._native.channel(channels[0]) if single else self._native.interleaved(channels)
            self._arrays[name] = make
        return self._arrays[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._layers)

    def __len__(self) -> int:
        return len(self._layers)

    def __repr__(self) -> str:
        width, height = self.size
        return f"<pointillist.Picture {width}×{height}: {', '.join(self)}>"

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in pixels."""
        return self._native.size

    @property
    def attributes(self) -> dict[str, Union[str, float, bytes]]:
        """What a file of the picture says of how it was made."""
        return self._native.attributes

    @property
    def report(self) -> dict[str, Any]:
        """The report of the render, as ``pointillist render --json`` writes it; empty for a picture that is not finished, or read from a file."""
        return self._report or {}

    @property
    def error(self) -> Optional[StatedError]:
        """The stated error; ``None`` if it is not known.

        >>> import pointillist
        >>> picture = pointillist.load(pointillist.cornell_box()).render(spp=16, size=(32, 32))
        >>> picture.error.p95.low < picture.error.p95.value < picture.error.p95.high
        True
        """
        error = self.report.get("error")
        return None if error is None else StatedError.of(error)

    def save(self, path: Union[str, os.PathLike[str]]) -> None:
        """Writes an ``.exr`` file of all channels, or a ``.png`` file of the picture as it is displayed."""
        self._native.save(path)

    def _repr_png_(self) -> bytes:
        """The picture in a notebook."""
        return self._native.png()

    def __array__(self, dtype: Any = None, copy: Optional[bool] = None) -> npt.NDArray[Any]:
        import numpy as np

        picture = self["picture"]
        if dtype is not None and np.dtype(dtype) != picture.dtype:
            if copy is False:
                raise ValueError("another type of numbers needs a copy")
            return picture.astype(dtype)
        return picture.copy() if copy else picture

    def __dlpack__(self, **options: Any) -> Any:
        """The array ``picture`` for other libraries, such as ``torch.from_dlpack``."""
        return self["picture"].__dlpack__(**options)

    def __dlpack_device__(self) -> tuple[int, int]:
        """The processor."""
        return self["picture"].__dlpack_device__()


def read(path: Union[str, os.PathLike[str]]) -> Picture:
    """Reads an EXR file of any program."""
    return Picture(_native.read(path))
