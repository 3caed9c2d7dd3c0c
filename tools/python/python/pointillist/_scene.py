"""Scenes: loading, changing and rendering them."""

from __future__ import annotations

import importlib
import os
import sys
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, Optional, Union

from . import _native
from ._dict import NAME, SceneText
from ._picture import ErrorInterval, Picture

if TYPE_CHECKING:
    from types import TracebackType


class SceneWarning(UserWarning):
    """A remark on a scene that does not prevent a picture."""


class Moment(NamedTuple):
    """How far a render is."""

    share: float
    """Share of the work that is done, 0 to 1; of a render to an error by its predicted time."""
    samples_per_pixel: float
    """Samples per pixel so far, overscan included."""
    seconds: float
    """Time since paths are traced."""
    error: Optional[ErrorInterval]
    """Relative error that 95 % of the picture stay below, or the quantile of ``error_at``; ``None`` before it is known."""

    @classmethod
    def of(
        cls, share: float, samples_per_pixel: float, seconds: float, error: Optional[tuple[float, float, float]]
    ) -> Moment:
        """From the numbers that the renderer tells."""
        return cls(share, samples_per_pixel, seconds, None if error is None else ErrorInterval(*error))


Size = Union[int, tuple[int, int], str]
Groups = Union[bool, str, Mapping[str, Union[str, Sequence[str]]]]


def _words(options: Mapping[str, Any]) -> list[str]:
    """Options as words of the command line: ``max_depth=3`` is ``--max-depth=3``, and ``adaptive=True`` is ``--adaptive``."""
    words = []
    for name, value in options.items():
        option = "--" + name.replace("_", "-")
        if value is None or value is False:
            continue
        if value is True:
            words.append(option)
        elif isinstance(value, (list, tuple)):
            words.append(f"{option}={','.join(map(str, value))}")
        else:
            words.append(f"{option}={value}")
    return words


def _size(size: Optional[Size]) -> Optional[str]:
    if size is None or isinstance(size, str):
        return size
    width, height = (size, size) if isinstance(size, int) else size
    return f"{width}x{height}"


def _groups(groups: Groups) -> Union[bool, str]:
    if isinstance(groups, (bool, str)):
        return groups
    members = ((name, [of] if isinstance(of, str) else of) for name, of in groups.items())
    return ";".join(f"{name}={','.join(of)}" for name, of in members)


class Scene:
    """A scene; it does not change: :meth:`edit` makes another one. Comes from :func:`load`."""

    def __init__(self, native: _native.Scene) -> None:
        """Wraps what the renderer has read."""
        self._native = native

    def __repr__(self) -> str:
        width, height = self.size
        return f"<pointillist.Scene {self._native.name}: {width}×{height}>"

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the picture that the scene asks for, in pixels."""
        return self._native.size

    @property
    def parameters(self) -> dict[str, Union[float, list[float]]]:
        """The values that :meth:`edit` changes, by name: the id of an object and the name of the value.

        A scale is a factor on what the scene says. Colours are linear Rec.709, transforms sixteen numbers, row by row. The pose of the
        camera is ``sensor.to_world``.

        >>> import pointillist
        >>> scene = pointillist.load(pointillist.cornell_box())
        >>> sorted(name for name in scene.parameters if name.startswith("lamp."))
        ['lamp.emission_color', 'lamp.emission_scale', 'lamp.to_world']
        """
        values = self._native.parameters()
        return {name: numbers[0] if len(numbers) == 1 else numbers for name, numbers in values}

    def edit(self, changes: Optional[Mapping[str, Any]] = None, **more: Any) -> Scene:
        """The scene with other values, by the names in :attr:`parameters`; in keywords two underscores stand for the dot.

        >>> import pointillist
        >>> scene = pointillist.load(pointillist.cornell_box())
        >>> brighter = scene.edit({"lamp.emission_scale": 2})
        >>> greener = brighter.edit(white__reflectance=[0.2, 0.7, 0.2])
        >>> [round(share, 2) for share in greener.parameters["white.reflectance"]]
        [0.2, 0.7, 0.2]

        Meshes and textures are shared with the scene that it is made of. A value that is changed again is that of the last change.
        """
        named = {**(changes or {}), **{name.replace("__", "."): value for name, value in more.items()}}
        return Scene(self._native.edit([(name, _numbers(name, value)) for name, value in named.items()]))

    def render(
        self,
        *,
        spp: Optional[int] = None,
        time: Optional[float] = None,
        error: Union[float, str, None] = None,
        size: Optional[Size] = None,
        method: Optional[str] = None,
        seed: int = 0,
        aovs: Union[str, Sequence[str], None] = None,
        light_groups: Groups = False,
        device: Optional[str] = "cpu",
        progress: Union[bool, Callable[[Moment], object]] = False,
        **options: Any,
    ) -> Picture:
        """Renders a picture.

        It ends after so many samples per pixel (``spp``) or seconds (``time``), or when 95 % of the picture have the relative ``error``
        or less, as ``0.01`` or ``"1%"``; otherwise after the samples that the scene asks for. Ctrl-C ends it with ``KeyboardInterrupt``.

        ``size`` is (width, height), ``method`` one of ``path``, ``bidirectional``, ``photon``, ``vcm``, ``auto`` and the others of the
        command line. ``aovs`` are layers beside the picture, as ``["depth", "normal:sh_normal"]``. ``light_groups`` gives a picture for
        each light (``True``) or for groups of ids (``{"key": ["lamp1", "lamp2"]}``), which add up to the picture. ``device`` is
        ``"cpu"``, the name of a Vulkan device, or ``None`` for the best one.

        ``progress`` is ``True`` for a bar (of ``tqdm``, if it is installed) or a function that is told the :class:`Moment` every 50 ms;
        an exception of it ends the render.

        Every other option of ``pointillist render`` is a keyword with underscores: ``deterministic=True``, ``max_depth=4``,
        ``denoise="wavelet"``, ``threads=2``.

        >>> import pointillist
        >>> scene = pointillist.load(pointillist.cornell_box())
        >>> picture = scene.render(spp=4, size=(16, 16), light_groups=True, max_depth=3)
        >>> picture["lamp"].shape
        (16, 16, 3)
        """
        words = _render_words(spp, time, error, size, method, seed, aovs, light_groups, device, options)
        if not callable(progress):
            if not progress:
                return Picture(self._native.render(words, None))
            with _Bar() as bar:
                return Picture(self._native.render(words, bar.update))
        watch = progress
        return Picture(self._native.render(words, lambda *told: watch(Moment.of(*told))))

    def progressive(
        self,
        *,
        every: float = 0.5,
        spp: Optional[int] = None,
        time: Optional[float] = None,
        error: Union[float, str, None] = None,
        size: Optional[Size] = None,
        method: Optional[str] = None,
        seed: int = 0,
        aovs: Union[str, Sequence[str], None] = None,
        light_groups: Groups = False,
        device: Optional[str] = "cpu",
        **options: Any,
    ) -> Progressive:
        """Renders on a thread of its own, and gives the picture on its way every so many seconds (``every``); the last one is that of :meth:`render`.

        Pictures on the way have no layers (``aovs``), light groups or report. One that nobody has taken is replaced by the next. The render
        ends early when the loop is left and nothing names its iterator any more, or by ``close()``.

        >>> import pointillist
        >>> scene = pointillist.load(pointillist.cornell_box())
        >>> with scene.progressive(spp=16, size=(32, 32), every=0.05) as pictures:
        ...     shares = [pictures.moment.share if pictures.moment else 1 for picture in pictures]
        >>> shares[-1], shares == sorted(shares)
        (1, True)
        """
        words = _render_words(spp, time, error, size, method, seed, aovs, light_groups, device, options)
        return Progressive(self._native.progressive(words, every))


def _render_words(
    spp: Optional[int],
    time: Optional[float],
    error: Union[float, str, None],
    size: Optional[Size],
    method: Optional[str],
    seed: int,
    aovs: Union[str, Sequence[str], None],
    light_groups: Groups,
    device: Optional[str],
    options: Mapping[str, Any],
) -> list[str]:
    named: dict[str, Any] = {
        "spp": spp,
        "time": time,
        "error": error,
        "size": _size(size),
        "integrator": method,
        "seed": seed,
        "aov": aovs,
        "light_groups": _groups(light_groups),
        "device": device,
    }
    return _words({**named, **options})


def _numbers(name: str, value: Any) -> list[float]:
    """A number, a switch, or all numbers of an array."""
    if isinstance(value, (bool, int, float)):
        return [float(value)]
    import numpy as np

    try:
        return [float(number) for number in np.asarray(value, dtype=np.float64).ravel()]
    except (TypeError, ValueError):
        raise TypeError(f"{name}: a {type(value).__name__} is no number or array of numbers") from None


class Progressive(Iterator[Picture]):
    """The pictures of a render that goes on meanwhile, from :meth:`Scene.progressive`."""

    def __init__(self, native: _native.Pictures) -> None:
        """Wraps a render that was started."""
        self._native = native
        self.moment: Optional[Moment] = None
        """How far the render was at the last picture; ``None`` at its end."""

    def __iter__(self) -> Progressive:
        return self

    def __next__(self) -> Picture:
        picture, told = next(self._native)
        self.moment = None if told is None else Moment.of(*told)
        return Picture(picture)

    def close(self) -> None:
        """Ends the render soon; its last picture is what it has then."""
        self._native.close()

    def __enter__(self) -> Progressive:
        return self

    def __exit__(
        self,
        kind: Optional[type[BaseException]],
        error: Optional[BaseException],
        trace: Optional[TracebackType],
    ) -> None:
        self.close()


class _Bar:
    """A progress bar: of tqdm where it is installed, otherwise a line on standard error."""

    def __init__(self) -> None:
        try:
            tqdm = importlib.import_module("tqdm.auto").tqdm
        except ImportError:
            self._bar: Any = None
        else:
            self._bar = tqdm(total=1.0, bar_format="{percentage:3.0f}%|{bar}| {elapsed}<{remaining} {postfix}")
        self._length = 0

    def __enter__(self) -> _Bar:
        return self

    def update(self, *told: Any) -> None:
        """Shows a moment."""
        moment = Moment.of(*told)
        error = f", error {moment.error.value:.1%}" if moment.error else ""
        text = f"{moment.samples_per_pixel:.1f} samples per pixel{error}"
        if self._bar is None:
            line = f"{moment.share:4.0%}  {text}"
            self._length = max(self._length, len(line))
            sys.stderr.write("\r" + line.ljust(self._length))
            sys.stderr.flush()
        else:
            self._bar.set_postfix_str(text, refresh=False)
            self._bar.update(moment.share - self._bar.n)

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.close()
        elif self._length:
            sys.stderr.write("\n")


def load(
    source: Union[str, os.PathLike[str], Mapping[str, Any]],
    *,
    lenient: bool = False,
    **defines: Any,
) -> Scene:
    """Loads a scene: a file of Mitsuba 3 (XML of version 0.4 to 3), a model (OBJ, PLY, glTF, USD), or a dictionary.

    Dictionaries are those of Mitsuba's ``load_dict``: a plugin has a ``type``, a key is an id or the name of a parameter, and
    ``{"type": "ref", "id": …}`` names another plugin. Arrays stand for files: ``vertices`` and ``faces`` (with ``normals`` and ``uvs``)
    of a ``mesh``, the ``data`` of a ``bitmap`` (bytes are sRGB, floating-point numbers linear), the ``grid`` of a ``gridvolume``. Every other key
    of a mesh that begins with ``vertex_`` or ``face_`` is an attribute, one or three floating-point numbers (linear) for each vertex or face, of
    the shape ``(n,)``, ``(n, 1)`` or ``(n, 3)``, which textures ``mesh_attribute`` name.

    >>> import numpy, pointillist
    >>> scene = pointillist.load({
    ...     "type": "scene",
    ...     "sensor": {"type": "perspective", "to_world": pointillist.Transform().look_at([0, 0, -4], [0, 0, 0])},
    ...     "triangle": {
    ...         "type": "mesh",
    ...         "vertices": numpy.eye(3),
    ...         "faces": [[0, 1, 2]],
    ...         "vertex_color": numpy.eye(3),
    ...         "bsdf": {"type": "diffuse", "reflectance": {"type": "mesh_attribute", "name": "vertex_color"}},
    ...     },
    ...     "sky": {"type": "constant"},
    ... })
    >>> scene.render(spp=1, size=(8, 8))["picture"].shape
    (8, 8, 3)

    Other keywords are values of the ``$names`` of a file, as ``-D`` gives them. ``lenient`` replaces plugins that are not supported.

    A scene that cannot be read raises :class:`SceneError` with ``file``, ``line`` and ``column``; for a dictionary, ``entry`` has the keys that
    lead to the mistake. Warnings are those of Python (:class:`SceneWarning`).
    """
    values = [(name, str(value)) for name, value in defines.items()]
    if isinstance(source, Mapping):
        if "type" not in source or source["type"] != "scene":
            raise ValueError("a scene is a dictionary with 'type': 'scene'")
        text = SceneText(source)
        try:
            native = _native.Scene.load_text(NAME, text.text, text.files, values, lenient)
        except _native.SceneError as error:
            if error.file == NAME:
                error.entry = text.place(error.line)
                if error.entry:
                    error.args = (f"{error.entry}: {error.args[0]}", *error.args[1:])
            raise
    else:
        native = _native.Scene.load_file(source, values, lenient)
    for message, file, line, column, is_idle in native.warnings:
        if not is_idle:
            warnings.warn(f"{file}:{line}:{column}: {message}", SceneWarning, stacklevel=2)
    return Scene(native)
