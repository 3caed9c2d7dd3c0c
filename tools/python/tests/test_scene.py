"""Scenes: files, dictionaries, arrays, changes, errors."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pointillist
from conftest import SMALL
from pointillist import Transform

XML = """<scene version="3.0.0">
  <integrator type="path"><integer name="max_depth" value="4"/></integrator>
  <sensor type="perspective" id="sensor">
    <float name="fov" value="40"/>
    <transform name="to_world"><lookat origin="0, 1, -5" target="0, 0, 0" up="0, 1, 0"/></transform>
    <film type="hdrfilm"><integer name="width" value="24"/><integer name="height" value="16"/></film>
  </sensor>
  <bsdf type="roughconductor" id="metal"><float name="alpha" value="0.2"/></bsdf>
  <shape type="sphere" id="ball"><float name="radius" value="0.7"/><ref id="metal"/></shape>
  <shape type="rectangle" id="floor">
    <transform name="to_world">
      <scale value="4"/><rotate x="1" angle="-90"/><translate y="-0.7"/>
    </transform>
    <bsdf type="diffuse"><rgb name="reflectance" value="0.5, 0.25, 0.125"/></bsdf>
  </shape>
  <emitter type="point" id="lamp"><point name="position" value="2, 4, -3"/><rgb name="intensity" value="30, 20, 10"/></emitter>
  <emitter type="constant" id="sky"><rgb name="radiance" value="0.1, 0.1, 0.2"/></emitter>
</scene>
"""

DICT: dict[str, Any] = {
    "type": "scene",
    "integrator": {"type": "path", "max_depth": 4},
    "sensor": {
        "type": "perspective",
        "fov": 40,
        "to_world": Transform().look_at([0, 1, -5], [0, 0, 0], [0, 1, 0]),
        "film": {"type": "hdrfilm", "width": 24, "height": 16},
    },
    "metal": {"type": "roughconductor", "alpha": 0.2},
    "ball": {"type": "sphere", "radius": 0.7, "bsdf": {"type": "ref", "id": "metal"}},
    "floor": {
        "type": "rectangle",
        "to_world": Transform().translate([0, -0.7, 0]).rotate([1, 0, 0], -90).scale(4),
        "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": [0.5, 0.25, 0.125]}},
    },
    "lamp": {"type": "point", "position": [2, 4, -3], "intensity": {"type": "rgb", "value": [30, 20, 10]}},
    "sky": {"type": "constant", "radiance": {"type": "rgb", "value": [0.1, 0.1, 0.2]}},
}


def same_bits(one: pointillist.Scene, other: pointillist.Scene) -> bool:
    """Whether both scenes give the same picture, which is not black."""
    pictures = [scene.render(**SMALL)["picture"] for scene in (one, other)]
    return bool(pictures[0].any()) and np.array_equal(*pictures)


def test_a_dictionary_gives_the_bits_of_the_file(tmp_path: Path) -> None:
    file = tmp_path / "scene.xml"
    file.write_text(XML, encoding="utf-8")
    assert same_bits(pointillist.load(file), pointillist.load(DICT))


def test_matrices_and_numpy_numbers_are_values(box: dict[str, Any]) -> None:
    shift = np.eye(4)
    shift[:3, 3] = [0.25, 0.5, -0.125]
    plain, arrays = dict(DICT), dict(DICT)
    plain["ball"] = {**DICT["ball"], "to_world": Transform().translate([0.25, 0.5, -0.125])}
    arrays["ball"] = {**DICT["ball"], "to_world": shift, "radius": np.float64(0.7)}
    arrays["lamp"] = {**DICT["lamp"], "position": np.array([2, 4, -3])}
    assert same_bits(pointillist.load(plain), pointillist.load(arrays))


VERTICES = np.array([[-1, -1, 0], [1, -1, 0.5], [1, 1, 0], [-1, 1, -0.5]], dtype=np.float32)
FACES = np.array([[0, 1, 2], [0, 2, 3]])


def test_a_mesh_of_arrays_is_the_mesh_of_its_file(tmp_path: Path) -> None:
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in VERTICES.astype(float).tolist()]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in FACES.tolist()]
    file = tmp_path / "mesh.obj"
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")
    of_file = {**DICT, "ball": {"type": "obj", "filename": str(file), "bsdf": {"type": "ref", "id": "metal"}}}
    mesh = {"type": "mesh", "vertices": VERTICES, "faces": FACES, "bsdf": {"type": "ref", "id": "metal"}}
    assert same_bits(pointillist.load(of_file), pointillist.load({**DICT, "ball": mesh}))


def test_normals_and_coordinates_of_meshes_are_used() -> None:
    normals = np.array([[-1, -1, -2], [1, -1, -2], [1, 1, -2], [-1, 1, -2]], dtype=np.float32)
    mesh = {"type": "mesh", "vertices": VERTICES, "faces": FACES, "bsdf": {"type": "ref", "id": "metal"}}
    flat = pointillist.load({**DICT, "ball": mesh}).render(**SMALL)
    smooth = pointillist.load({**DICT, "ball": {**mesh, "normals": normals}}).render(**SMALL)
    assert not np.array_equal(flat["picture"], smooth["picture"])


def coloured(mesh: dict[str, Any], attribute: str) -> pointillist.Scene:
    """The scene with a mesh whose colour is an attribute."""
    reflectance = {"type": "mesh_attribute", "name": attribute}
    bsdf = {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": reflectance}}
    return pointillist.load({**DICT, "ball": {**mesh, "bsdf": bsdf}})


COLORS = np.array([[0.75, 0.25, 0.125], [0.5, 0.5, 0.25], [0.125, 0.75, 0.5], [0.25, 0.125, 0.75]])


@pytest.mark.parametrize("attribute", ["vertex_color", "face_color", "vertex_texcoord", "vertex_glow_color", "face_a_b"])
@pytest.mark.parametrize("channels", [0, 1, 3])
def test_attributes_of_meshes_are_those_of_their_file(tmp_path: Path, attribute: str, channels: int) -> None:
    of_faces = attribute.startswith("face_")
    values = COLORS[: len(FACES) if of_faces else len(VERTICES), : max(channels, 1)]
    own = attribute.partition("_")[2]
    ends = ["r", "g", "b"] if own == "color" and channels == 3 else [f"{own}_{end}" for end in "0123"][: values.shape[1]]
    properties = [f"property float {end}" for end in ends]
    rows = lambda plain, of_it: [" ".join(map(str, [*row, *more])) for row, more in zip(plain, of_it)]
    nothing: list[list[float]] = [[]] * 4
    lines = ["ply", "format ascii 1.0", f"element vertex {len(VERTICES)}", *(f"property float {axis}" for axis in "xyz")]
    lines += [] if of_faces else properties
    lines += [f"element face {len(FACES)}", "property list uchar int vertex_indices", *(properties if of_faces else []), "end_header"]
    lines += rows(VERTICES.tolist(), nothing if of_faces else values.tolist())
    lines += rows([[3, *face] for face in FACES.tolist()], values.tolist() if of_faces else nothing)
    file = tmp_path / "mesh.ply"
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")
    given = values[:, 0] if channels == 0 else values
    mesh = {"type": "mesh", "vertices": VERTICES, "faces": FACES, attribute: given, "vertex_other": np.ones(4), "face_other": np.ones((2, 3))}
    of_arrays = coloured(mesh, attribute)
    assert same_bits(coloured({"type": "ply", "filename": str(file)}, attribute), of_arrays)
    assert not np.array_equal(
        coloured({**mesh, attribute: given / 2}, attribute).render(**SMALL)["picture"], of_arrays.render(**SMALL)["picture"]
    )


@pytest.mark.parametrize(
    ("attribute", "value", "error", "message"),
    [
        ("vertex_color", np.ones((2, 3)), ValueError, r"ball.vertex_color: the shape is .*\(4, 3\).* each vertex, and not \(2, 3\)"),
        ("vertex_color", np.ones((4, 4)), ValueError, r"ball.vertex_color: .*not \(4, 4\)"),
        ("vertex_color", np.ones((4, 3, 1)), ValueError, r"ball.vertex_color: .*not \(4, 3, 1\)"),
        ("vertex_color", 0.5, ValueError, r"ball.vertex_color: .*not \(\)"),
        ("face_color", np.ones((4, 3)), ValueError, r"ball.face_color: the shape is .*\(2, 3\).* each face, and not \(4, 3\)"),
        ("vertex_color", np.ones((4, 3), np.uint8), TypeError, "ball.vertex_color: .*uint8"),
        ("vertex_color", ["red"] * 4, TypeError, "ball.vertex_color: .*floating-point"),
        ("vertex_", np.ones(4), ValueError, "ball.vertex_: .*name"),
        ("vertex_my colour", np.ones(4), ValueError, "ball.vertex_my colour: .*blanks"),
    ],
)
def test_attributes_of_other_shapes_are_refused(attribute: str, value: Any, error: type[Exception], message: str) -> None:
    mesh = {"type": "mesh", "vertices": VERTICES, "faces": FACES, attribute: value}
    with pytest.raises(error, match=message):
        pointillist.load({**DICT, "ball": mesh})


def test_face_normals_is_the_switch_of_the_plugin() -> None:
    normals = np.array([[-0.6, 0, 0.8], [0.6, 0, 0.8], [0, 0.6, 0.8], [0, -0.6, 0.8]], dtype=np.float32)
    mesh = {"type": "mesh", "vertices": VERTICES, "faces": FACES, "normals": normals, "bsdf": {"type": "ref", "id": "metal"}}
    smooth, flat = (
        pointillist.load({**DICT, "ball": {**mesh, "face_normals": switch}}).render(**SMALL)["picture"] for switch in (False, True)
    )
    assert not np.array_equal(smooth, flat)


@pytest.mark.parametrize("kind", [np.float32, np.uint8])
def test_a_texture_of_one_colour_is_that_colour(kind: type) -> None:
    values: list[Any] = [0.5, 0.25, 0.125]
    one: dict[str, Any] = {"type": "rgb", "value": values}
    if kind is np.uint8:
        values, one = [255, 255, 255], {"type": "rgb", "value": [1, 1, 1]}
    data = np.full((4, 8, 3), values, dtype=kind)
    floors = [
        {**DICT["floor"], "bsdf": {"type": "diffuse", "reflectance": reflectance}}
        for reflectance in (one, {"type": "bitmap", "data": data})
    ]
    plain, textured = (pointillist.load({**DICT, "floor": floor}).render(**SMALL)["picture"] for floor in floors)
    assert np.allclose(plain, textured, rtol=1e-2, atol=1e-5)


def test_rows_of_textures_begin_at_the_top(tmp_path: Path) -> None:
    """The array of a picture, and the file of the same picture, are the same texture."""
    data = np.random.default_rng(1).random((5, 7, 3), dtype=np.float32)
    native = pointillist._native.Picture.of_arrays(data, None)
    file = tmp_path / "texture.exr"
    native.save(file)
    scenes = []
    for texture in ({"type": "bitmap", "data": data}, {"type": "bitmap", "filename": str(file)}):
        bsdf = {"type": "diffuse", "reflectance": texture}
        scenes.append(pointillist.load({**DICT, "floor": {**DICT["floor"], "bsdf": bsdf}}))
    assert same_bits(*scenes)


def test_grids_are_media() -> None:
    grid = np.random.default_rng(2).random((4, 5, 6), dtype=np.float32)
    fog = {
        "type": "heterogeneous",
        "sigma_t": {"type": "gridvolume", "grid": grid, "to_world": Transform().translate([-1, -1, -1]).scale(2)},
        "albedo": 0.5,
        "scale": 3,
    }
    cube = {"type": "cube", "bsdf": {"type": "null"}, "interior": fog}
    foggy = pointillist.load({**DICT, "integrator": {"type": "volpath"}, "fog": cube}).render(**SMALL)
    clear = pointillist.load({**DICT, "integrator": {"type": "volpath"}}).render(**SMALL)
    assert not np.array_equal(foggy["picture"], clear["picture"])


def test_changes_are_those_of_the_scene() -> None:
    scene = pointillist.load(DICT)
    before = scene.render(**SMALL)["picture"].copy()
    edited = scene.edit({"lamp.position": [-2, 4, -3]}).edit(metal__alpha=0.4)
    written = {**DICT, "lamp": {**DICT["lamp"], "position": [-2, 4, -3]}, "metal": {**DICT["metal"], "alpha": 0.4}}
    assert same_bits(edited, pointillist.load(written))
    assert np.array_equal(scene.render(**SMALL)["picture"], before)
    assert edited.parameters["metal.alpha"] == pytest.approx(0.4)


def test_the_camera_moves() -> None:
    scene = pointillist.load(DICT)
    pose = np.reshape(scene.parameters["sensor.to_world"], (4, 4))
    pose[0, 3] += 0.5
    moved = scene.edit({"sensor.to_world": pose})
    assert np.reshape(moved.parameters["sensor.to_world"], (4, 4))[0, 3] == pytest.approx(pose[0, 3])
    assert not np.array_equal(moved.render(**SMALL)["picture"], scene.render(**SMALL)["picture"])


def test_wrong_changes_are_refused() -> None:
    scene = pointillist.load(DICT)
    with pytest.raises(ValueError, match="did you mean `metal.alpha`"):
        scene.edit({"metal.alhpa": 1})
    with pytest.raises(ValueError, match="2 numbers"):
        scene.edit({"lamp.position": [1, 2]})
    with pytest.raises(TypeError, match="lamp.position"):
        scene.edit({"lamp.position": "here"})


def test_errors_have_a_place(tmp_path: Path) -> None:
    file = tmp_path / "broken.xml"
    file.write_text(XML.replace('value="0.7"', 'value="much"'), encoding="utf-8")
    with pytest.raises(pointillist.SceneError) as raised:
        pointillist.load(file)
    error = raised.value
    line = next(i for i, text in enumerate(XML.splitlines(), 1) if 'value="0.7"' in text)
    assert (error.file, error.line) == (str(file), line)
    assert file.read_text(encoding="utf-8").splitlines()[line - 1][error.column - 1 :].lstrip('"').startswith("much")
    assert f"{file}:{line}:" in str(error)


def test_errors_of_dictionaries_name_the_entry() -> None:
    with pytest.raises(pointillist.SceneError) as raised:
        pointillist.load({**DICT, "ball": {**DICT["ball"], "radius": "much"}})
    assert raised.value.entry == "ball.radius"
    assert str(raised.value).startswith("ball.radius: ")
    with pytest.raises(ValueError, match="ball.center"):
        pointillist.load({**DICT, "ball": {**DICT["ball"], "center": [1, 2]}})
    with pytest.raises(TypeError, match="ball.center"):
        pointillist.load({**DICT, "ball": {**DICT["ball"], "center": object()}})
    with pytest.raises(ValueError, match="'type': 'scene'"):
        pointillist.load({"type": "sphere"})


def test_a_file_that_is_not_there_is_an_error() -> None:
    with pytest.raises(pointillist.SceneError, match=r"there/is/no.xml"):
        pointillist.load("there/is/no.xml")


def test_warnings_are_those_of_python() -> None:
    with pytest.warns(pointillist.SceneWarning, match="no `raduis`"):
        pointillist.load({**DICT, "ball": {**DICT["ball"], "raduis": 1.0}})
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        pointillist.load(DICT)


def test_values_of_names_are_keywords(root: Path) -> None:
    assert pointillist.load(root / "scenes" / "cornell.xml", res=40).size == (40, 40)
