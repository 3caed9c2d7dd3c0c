"""A scene to begin with."""

from __future__ import annotations

from typing import Any

from .transform import Transform


def cornell_box() -> dict[str, Any]:
    """A box with a red and a green wall, two cubes and a lamp, as a dictionary for :func:`load`; it may be changed before.

    >>> import pointillist
    >>> box = pointillist.cornell_box()
    >>> box["left"]["bsdf"] = {"type": "ref", "id": "white"}
    >>> pointillist.load(box).size
    (256, 256)
    """

    def wall(to_world: Transform, bsdf: str) -> dict[str, Any]:
        return {"type": "rectangle", "to_world": to_world, "bsdf": {"type": "ref", "id": bsdf}}

    def paint(*rgb: float) -> dict[str, Any]:
        return {"type": "diffuse", "reflectance": {"type": "rgb", "value": list(rgb)}}

    def block(at: list[float], angle: float, half: list[float]) -> dict[str, Any]:
        to_world = Transform().translate(at).rotate([0, 1, 0], angle).scale(half)
        return {"type": "cube", "to_world": to_world, "bsdf": {"type": "ref", "id": "white"}}

    move = Transform().translate
    return {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": 8},
        "sensor": {
            "type": "perspective",
            "fov_axis": "smaller",
            "fov": 39.3,
            "to_world": Transform().look_at([0, 0, 3.9], [0, 0, 0]),
            "film": {"type": "hdrfilm", "width": 256, "height": 256},
            "sampler": {"type": "independent", "sample_count": 64},
        },
        "white": paint(0.73, 0.73, 0.73),
        "red": paint(0.57, 0.04, 0.04),
        "green": paint(0.1, 0.38, 0.08),
        "floor": wall(move([0, -1, 0]).rotate([1, 0, 0], -90), "white"),
        "ceiling": wall(move([0, 1, 0]).rotate([1, 0, 0], 90), "white"),
        "back": wall(move([0, 0, -1]), "white"),
        "left": wall(move([-1, 0, 0]).rotate([0, 1, 0], 90), "red"),
        "right": wall(move([1, 0, 0]).rotate([0, 1, 0], -90), "green"),
        "small": block([0.34, -0.7, 0.38], -17, [0.3, 0.3, 0.3]),
        "large": block([-0.33, -0.4, -0.28], 18, [0.3, 0.6, 0.3]),
        "lamp": {
            "type": "rectangle",
            "to_world": move([0, 0.99, 0.01]).rotate([1, 0, 0], 90).scale([0.23, 0.19, 0.19]),
            "bsdf": {"type": "ref", "id": "white"},
            "emitter": {"type": "area", "radiance": {"type": "rgb", "value": [18.4, 15.6, 8.0]}},
        },
    }
