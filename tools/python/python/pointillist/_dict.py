"""Scenes as dictionaries: becomes the text of a scene file, with arrays as files in memory."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Mapping
from typing import Any
from xml.sax.saxutils import quoteattr

from ._native import plugins
from .transform import Transform

NAME = "<dict>"
"""What stands for the file of a dictionary in messages."""

_TAGS: dict[str, list[str]] = {}
# Keys that are sorts of plugins, which stand in another one without a name.
_NESTED = {"bsdf", "emitter", "film", "integrator", "phase", "rfilter", "sampler", "sensor", "shape"}
# Sorts of plugins that are values of parameters: their keys are names.
_NAMED = {"medium", "spectrum", "texture", "volume"}


def _tags(plugin: str) -> list[str]:
    """The sorts of plugins that have one of this name."""
    if not _TAGS:
        for tag, names in plugins():
            for name in names:
                _TAGS.setdefault(name, []).append(tag)
    return _TAGS.get(plugin, [])


class SceneText:
    """The text of a scene, its files, and which entry of the dictionary each line is of."""

    def __init__(self, scene: Mapping[str, Any]) -> None:
        if scene.get("type") != "scene":
            raise ValueError("a scene is a dictionary with 'type': 'scene'")
        self._lines: list[str] = []
        self._places: list[str] = []
        self.files: list[tuple[str, bytes]] = []
        # An array that stands in several places is one file.
        self._arrays: dict[int, tuple[Any, str]] = {}
        self._add('<scene version="3.0.0">', "")
        for key, value in scene.items():
            if key not in ("type", "id"):
                self._entry(key, value, parent="", depth=1)
        self._add("</scene>", "")

    @property
    def text(self) -> str:
        """The text."""
        return "\n".join(self._lines) + "\n"

    def place(self, line: int) -> str:
        """The entry that a line, counted from 1, was made of: its keys, joined by dots."""
        return self._places[line - 1] if 0 < line <= len(self._places) else ""

    def _add(self, line: str, place: str, depth: int = 0) -> None:
        self._lines.append("  " * depth + line)
        self._places.append(place)

    def _entry(self, key: str, value: Any, parent: str, depth: int) -> None:
        place = f"{parent}.{key}" if parent else key
        if isinstance(value, Mapping):
            self._mapping(key, value, place, depth, is_root=not parent)
            return
        name = quoteattr(key)
        if isinstance(value, bool):
            self._add(f'<boolean name={name} value="{str(value).lower()}"/>', place, depth)
        elif isinstance(value, int):
            self._add(f'<integer name={name} value="{value}"/>', place, depth)
        elif isinstance(value, float):
            self._add(f'<float name={name} value="{float(value)!r}"/>', place, depth)
        elif isinstance(value, str):
            self._add(f"<string name={name} value={_attribute(value, place)}/>", place, depth)
        elif isinstance(value, Transform):
            self._transform(name, value, place, depth)
        else:
            self._array(key, value, place, depth)

    def _transform(self, name: str, transform: Transform, place: str, depth: int) -> None:
        self._add(f"<transform name={name}>", place, depth)
        for step in transform.elements():
            self._add(step, place, depth + 1)
        self._add("</transform>", place, depth)

    def _array(self, key: str, value: Any, place: str, depth: int) -> None:
        """A number of NumPy, three numbers, or a matrix."""
        import numpy as np

        name = quoteattr(key)
        try:
            numbers = np.asarray(value, dtype=np.float64)
        except (TypeError, ValueError):
            raise TypeError(f"{place}: a {type(value).__name__} is no value of a scene") from None
        if numbers.shape == ():
            plain = value.item() if hasattr(value, "item") else float(numbers)
            self._entry(key, plain, parent=place.rpartition(".")[0], depth=depth)
        elif numbers.shape == (3,):
            x, y, z = (float(number) for number in numbers)
            self._add(f'<point name={name} value="{x!r}, {y!r}, {z!r}"/>', place, depth)
        elif numbers.shape == (4, 4):
            self._transform(name, Transform(numbers), place, depth)
        else:
            raise ValueError(
                f"{place}: an array of the shape {numbers.shape} is neither a number, nor three numbers, nor a 4×4 matrix; "
                "pictures are the 'data' of a 'bitmap', and grids that of a 'gridvolume'"
            )

    def _mapping(self, key: str, value: Mapping[str, Any], place: str, depth: int, is_root: bool) -> None:
        kind = value.get("type")
        if not isinstance(kind, str):
            raise ValueError(f"{place}: a dictionary needs a 'type'")
        name = quoteattr(key)
        if kind == "ref":
            named = "" if is_root or key in _NESTED else f" name={name}"
            self._add(f"<ref id={_attribute(str(value['id']), place)}{named}/>", place, depth)
            return
        if kind in ("rgb", "srgb"):
            numbers = value["value"]
            text = numbers if isinstance(numbers, str) else _listed(numbers, place)
            self._add(f'<{kind} name={name} value="{text}"/>', place, depth)
            return
        if kind == "spectrum":
            self._spectrum(name, value, place, depth)
            return
        if kind == "blackbody" and "temperature" in value:
            scale = f' scale="{float(value["scale"])!r}"' if "scale" in value else ""
            temperature = float(value["temperature"])
            self._add(f'<blackbody name={name} temperature="{temperature!r}"{scale}/>', place, depth)
            return
        self._plugin(key, kind, value, place, depth, is_root)

    def _spectrum(self, name: str, value: Mapping[str, Any], place: str, depth: int) -> None:
        if "filename" in value:
            file = _attribute(str(value["filename"]), place)
            self._add(f"<spectrum name={name} filename={file}/>", place, depth)
            return
        given = value["value"]
        if isinstance(given, str):
            text = given
        elif isinstance(given, (int, float)):
            text = repr(float(given))
        else:
            text = ", ".join(f"{float(wavelength)!r}:{float(v)!r}" for wavelength, v in given)
        self._add(f'<spectrum name={name} value="{text}"/>', place, depth)

    def _plugin(
        self, key: str, kind: str, value: Mapping[str, Any], place: str, depth: int, is_root: bool
    ) -> None:
        value = dict(value)
        if kind == "mesh":
            kind, value = "ply", self._mesh(value, place)
        elif kind == "bitmap" and "data" in value:
            value["filename"] = self._file(value.pop("data"), _picture, place, "data")
        elif kind == "gridvolume" and ("grid" in value or "data" in value):
            grid = value.pop("grid") if "grid" in value else value.pop("data")
            value["filename"] = self._file(grid, _grid, place, "grid")
        # What a dictionary does not know the reader refuses, with a suggestion.
        tags = _tags(kind) or [key if key in _NESTED else "shape"]
        tag = key if key in tags else tags[0]
        # As in Mitsuba a key is an id; nested objects have those of what is around them before theirs.
        id = str(value.pop("id", place))
        name = f" name={quoteattr(key)}" if tag in _NAMED and not is_root else ""
        self._add(f"<{tag} type={_attribute(kind, place)} id={_attribute(id, place)}{name}>", place, depth)
        for entry, of_it in value.items():
            if entry != "type":
                self._entry(entry, of_it, parent=place, depth=depth + 1)
        self._add(f"</{tag}>", place, depth)

    def _mesh(self, value: dict[str, Any], place: str) -> dict[str, Any]:
        """A mesh of arrays as the file of one."""
        arrays = {name: value.pop(name, None) for name in ("vertices", "faces", "normals", "uvs")}
        for needed in ("vertices", "faces"):
            if arrays[needed] is None:
                raise ValueError(f"{place}: a mesh needs {needed!r}, an array of three numbers each")
        # `face_normals` is a switch of the plugin.
        named = [name for name in value if name.startswith(("vertex_", "face_")) and name != "face_normals"]
        file = f"{place}.ply"
        self.files.append((file, _ply(arrays, {name: value.pop(name) for name in named}, place)))
        return {"filename": file, **value}

    def _file(self, array: Any, encode: Any, place: str, what: str) -> str:
        """The name of the file that an array becomes; the same one for the same array."""
        known = self._arrays.get(id(array))
        if known is None:
            bytes_, ending = encode(array, f"{place}.{what}")
            known = self._arrays[id(array)] = (array, f"{place}.{ending}")
            self.files.append((known[1], bytes_))
        return known[1]


def _attribute(text: str, place: str) -> str:
    """A text as the value of an attribute."""
    if "$" in text:
        raise ValueError(f"{place}: `$` begins the name of a value in a scene file; {text!r} cannot have one")
    return quoteattr(text, {"\n": "&#10;", "\r": "&#13;", "\t": "&#9;"})


def _listed(numbers: Any, place: str) -> str:
    """Numbers of a colour: three, or one for all."""
    listed = [numbers] * 3 if isinstance(numbers, (int, float)) else list(numbers)
    if len(listed) != 3:
        raise ValueError(f"{place}: a colour has 3 numbers, not {len(listed)}")
    return ", ".join(repr(float(number)) for number in listed)


def _ply(arrays: dict[str, Any], attributes: dict[str, Any], place: str) -> bytes:
    """A binary PLY file of a mesh, with attributes by their names ``vertex_…`` and ``face_…``."""
    import numpy as np

    def read(name: str, columns: int, dtype: str) -> Any:
        given = arrays[name]
        array = np.asarray(given)
        if array.ndim != 2 or array.shape[1] != columns:
            raise ValueError(f"{place}.{name}: the shape is (number, {columns}), not {array.shape}")
        if dtype == "<i4" and array.dtype.kind not in "iu":
            raise TypeError(f"{place}.{name}: indices are integers, not {array.dtype}")
        return array.astype(dtype)

    def attribute(name: str, count: int) -> tuple[list[str], Any]:
        """Names of the properties of an attribute, and its numbers ``[count][1 or 3]``."""
        array = np.asarray(attributes[name])
        columns = array[:, None] if array.ndim == 1 else array
        if columns.ndim != 2 or columns.shape[1] not in (1, 3) or len(columns) != count:
            wanted = f"({count},), ({count}, 1) or ({count}, 3), one or three numbers for each {name.partition('_')[0]}"
            raise ValueError(f"{place}.{name}: the shape is {wanted}, and not {array.shape}")
        if array.dtype.kind not in "fiu" or array.dtype.itemsize == 1:
            raise TypeError(f"{place}.{name}: an attribute is of floating-point numbers, not of {array.dtype}")
        own = name.partition("_")[2]
        if not own or not own.isascii() or not own.isprintable() or " " in own:
            raise ValueError(f"{place}.{name}: the name of an attribute goes on after its first `_`, in ASCII and without blanks")
        return [f"{own}_{i}" for i in range(columns.shape[1])], columns.astype("<f4")

    vertices, faces = read("vertices", 3, "<f4"), read("faces", 3, "<i4")
    parts, names = [vertices], ["x", "y", "z"]
    for name, columns in (("normals", ["nx", "ny", "nz"]), ("uvs", ["u", "v"])):
        if arrays[name] is not None:
            array = read(name, len(columns), "<f4")
            if len(array) != len(vertices):
                raise ValueError(f"{place}.{name}: there are {len(array)}, and {len(vertices)} vertices")
            parts.append(array)
            names += columns
    of_faces: list[str] = []
    face_parts: list[Any] = [np.empty((len(faces), 0), "<f4")]
    for name in attributes:
        is_of_faces = name.startswith("face_")
        properties, numbers = attribute(name, len(faces) if is_of_faces else len(vertices))
        (of_faces if is_of_faces else names).extend(properties)
        (face_parts if is_of_faces else parts).append(numbers)
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(vertices)}"]
    header += [f"property float {name}" for name in names]
    header += [f"element face {len(faces)}", "property list uchar int vertex_indices"]
    header += [*(f"property float {name}" for name in of_faces), "end_header", ""]
    corners = np.empty(len(faces), dtype=[("n", "u1"), ("i", "<i4", 3), ("a", "<f4", (len(of_faces),))])
    corners["n"], corners["i"], corners["a"] = 3, faces, np.concatenate(face_parts, axis=1)
    points = np.ascontiguousarray(np.concatenate(parts, axis=1), dtype="<f4")
    return "\n".join(header).encode() + points.tobytes() + corners.tobytes()


def _picture(array: Any, place: str) -> tuple[bytes, str]:
    """A picture file: PNG of bytes, which are sRGB unless `raw`, and PFM of numbers, which are linear."""
    import numpy as np

    texels = np.asarray(array)
    if texels.ndim == 2:
        texels = texels[:, :, None]
    if texels.ndim != 3 or texels.shape[2] not in (1, 3) or texels.size == 0:
        raise ValueError(f"{place}: a picture has the shape (height, width) or (height, width, 1 or 3), not {np.shape(array)}")
    height, width, channels = texels.shape
    if texels.dtype == np.uint8:
        rows = np.ascontiguousarray(texels).reshape(height, width * channels)
        # Every row begins with its filter, which is none.
        data = np.concatenate([np.zeros((height, 1), np.uint8), rows], axis=1).tobytes()
        size = struct.pack(">IIBBBBB", width, height, 8, 2 if channels == 3 else 0, 0, 0, 0)
        chunks = [(b"IHDR", size), (b"IDAT", zlib.compress(data, 1)), (b"IEND", b"")]
        coded = (
            struct.pack(">I", len(body)) + tag + body + struct.pack(">I", zlib.crc32(tag + body)) for tag, body in chunks
        )
        return b"\x89PNG\r\n\x1a\n" + b"".join(coded), "png"
    if texels.dtype.kind != "f":
        raise TypeError(f"{place}: a picture is of uint8 or of floating-point numbers, not of {texels.dtype}")
    header = f"{'PF' if channels == 3 else 'Pf'}\n{width} {height}\n-1.0\n".encode()
    return header + np.ascontiguousarray(texels[::-1], dtype="<f4").tobytes(), "pfm"


def _grid(array: Any, place: str) -> tuple[bytes, str]:
    """A `.vol` file of values `[z][y][x]` or `[z][y][x][channel]`."""
    import numpy as np

    values = np.asarray(array, dtype="<f4")
    if values.ndim == 3:
        values = values[..., None]
    if values.ndim != 4 or values.size == 0:
        raise ValueError(f"{place}: a grid has the shape (z, y, x) or (z, y, x, channels), not {np.shape(array)}")
    z, y, x, channels = values.shape
    header = b"VOL\x03" + struct.pack("<5i6f", 1, x, y, z, channels, 0, 0, 0, 1, 1, 1)
    return header + np.ascontiguousarray(values).tobytes(), "vol"
