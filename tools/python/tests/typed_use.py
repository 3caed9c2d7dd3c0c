"""Uses of the package as its users write them; mypy checks that they have the types that they should."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

import pointillist


def use() -> None:
    """Never called: it is there for its types."""
    scene: pointillist.Scene = pointillist.load("scene.xml", lenient=True, res=64)
    scene = scene.edit({"lamp.emission_scale": 2.0}, ball__alpha=0.1)
    picture: pointillist.Picture = scene.render(
        spp=4, size=(8, 8), aovs=["depth"], light_groups={"key": ["a", "b"]}, progress=lambda moment: moment.share, max_depth=3
    )
    array: npt.NDArray[np.float32] = picture["picture"]
    error: pointillist.StatedError | None = picture.error
    high: float = error.p95.high if error else 0.0
    for seen in scene.progressive(time=1.0):
        array = seen["picture"]
    value: float = float(pointillist.compare(array, picture, "flip")["flip"])
    green: bool = pointillist.regress.run("renders", device="cpu").is_green
    print(high, value, green)
