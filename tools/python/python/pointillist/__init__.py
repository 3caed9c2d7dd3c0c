"""Pointillist: a spectral path tracer whose pictures state their error.

>>> import pointillist
>>> scene = pointillist.load(pointillist.cornell_box())
>>> picture = scene.render(spp=4, size=(32, 32))
>>> picture["picture"].shape
(32, 32, 3)

A scene comes from a file that Mitsuba 3 reads, from a model (OBJ, PLY, glTF, USD) or from a dictionary, with meshes and textures as arrays.
A picture is a mapping from names to NumPy arrays, which other libraries read without a copy.
"""

from ._demo import cornell_box
from ._native import RenderError, SceneError, __version__
from ._picture import ErrorInterval, Picture, StatedError, read
from ._scene import Moment, Progressive, Scene, SceneWarning, load
from ._tools import Comparison, Metric, Study, compare, study
from .transform import Transform
from . import regress

__all__ = [
    "Comparison",
    "ErrorInterval",
    "Metric",
    "Moment",
    "Picture",
    "Progressive",
    "RenderError",
    "Scene",
    "SceneError",
    "SceneWarning",
    "StatedError",
    "Study",
    "Transform",
    "__version__",
    "compare",
    "cornell_box",
    "load",
    "read",
    "regress",
    "study",
]
