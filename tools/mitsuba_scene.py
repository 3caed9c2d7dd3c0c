"""Renders a scene with Mitsuba 3 into an EXR file, with the box filter and linear Rec.709: one rendering of `pointillist regress run tests/mitsuba`,
and what other tools need to load scenes into Mitsuba.

Usage: tools/mitsuba tools/mitsuba_scene.py SCENE.xml -o PICTURE.exr --seed N [--spp N] [--size WxH] [--variant NAME]

Exit status: 0, or 1 with a message where the scene cannot be read or rendered.
"""

import argparse
import os
import tempfile
import xml.etree.ElementTree as ElementTree

import numpy as np


class Failed(SystemExit):
    """Something that could not be run; ends a program that does not catch it with its message."""


# The angle in degrees under which Mitsuba 3 shows the sun by default.
SUN_APERTURE = 0.5358


def upgrade(tree):
    """Changes what Mitsuba 3 does not by itself in a file for Mitsuba 0.6: its skies have +y up instead of +z, it filters textures over
    the footprint of a pixel, and a transform may be written lookAt."""
    if tree.getroot().get("version", "3").split(".")[0] != "0":
        return
    for element in list(tree.iter("lookAt")):
        element.tag = "lookat"
    for element in tree.iter("string"):
        if element.get("name") == "filterType" and element.get("value") in ("trilinear", "ewa"):
            element.set("value", "bilinear")
    for sky in tree.iter("emitter"):
        if sky.get("type") not in ("sky", "sun", "sunsky") or sky.find("transform") is not None:
            continue
        for child in list(sky):
            name = child.get("name")
            if name == "sunRadiusScale":
                child.attrib = {"name": "sun_aperture", "value": str(SUN_APERTURE * float(child.get("value")))}
        turned = ElementTree.SubElement(sky, "transform", name="to_world")
        ElementTree.SubElement(turned, "rotate", x="1", angle="-90")


def box_filtered(scene, size, integrator=None):
    """The text of the scene file with a box filter, float32 RGB pixels and, if given, another size and another integrator."""
    tree = ElementTree.parse(scene)
    upgrade(tree)
    if integrator:
        # Mitsuba creates what the file names, even if the caller renders by another one.
        for element in tree.iter("integrator"):
            element.clear()
            element.set("type", integrator)
    films = list(tree.iter("film"))
    if not films:
        raise Failed(f"{scene} has no <film> of its own: put the sensor into this file")
    for film in films:
        replaced = {"pixel_format", "component_format"} | ({"width", "height"} if size else set())
        for child in list(film):
            if child.tag == "rfilter" or child.get("name") in replaced:
                film.remove(child)
        ElementTree.SubElement(film, "rfilter", type="box")
        ElementTree.SubElement(film, "string", name="pixel_format", value="rgb")
        ElementTree.SubElement(film, "string", name="component_format", value="float32")
        for name, value in zip(("width", "height"), size or ()):
            ElementTree.SubElement(film, "integer", name=name, value=str(value))
    return ElementTree.tostring(tree.getroot(), encoding="unicode")


def load_box_filtered(mi, scene, defines, size, integrator=None):
    """The scene in Mitsuba, with film and integrator of box_filtered()."""
    with tempfile.TemporaryDirectory() as place:
        copy = os.path.join(place, "scene.xml")
        with open(copy, "w") as f:
            f.write(box_filtered(scene, size, integrator))
        mi.file_resolver().prepend(os.path.dirname(os.path.abspath(scene)))
        config = mi.parser.ParserConfig(mi.variant())
        # Files for Mitsuba 0.6 have properties that Mitsuba 3 lacks.
        config.unused_properties = mi.LogLevel.Warn
        state = mi.parser.parse_file(config, copy, **defines)
        mi.parser.transform_all(config, state)
        return mi.parser.instantiate(config, state)


def main_layer(mi, path):
    """R, G, B of the main layer of an EXR file, as (y, x, channel)."""
    bitmap = mi.Bitmap(path)
    names = [field.name for field in bitmap.struct_()]
    pixels = np.array(bitmap)
    try:
        return pixels[..., [names.index(c) for c in "RGB"]].astype(np.float64)
    except ValueError:
        raise Failed(f"{path} has no channels R, G, B, only {', '.join(names)}") from None


def arguments():
    p = argparse.ArgumentParser(
        prog="mitsuba_scene", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    p.add_argument("scene", help="scene file of Mitsuba")
    p.add_argument("-o", "--output", required=True, help="the picture: EXR of 32-bit R, G, B")
    p.add_argument("--seed", type=int, required=True)
    p.add_argument("--spp", type=int, default=64, help="samples per pixel (64)")
    p.add_argument("--size", help="WxH instead of the size in the scene")
    p.add_argument("--variant", default="scalar_spectral", help="Mitsuba's (scalar_spectral; scalar_rgb where it has no colours)")
    return p.parse_args()


def main():
    a = arguments()
    import mitsuba as mi

    mi.set_variant(a.variant)
    size = tuple(int(side) for side in a.size.lower().split("x")) if a.size else None
    loaded = load_box_filtered(mi, a.scene, {}, size)
    # Sensors of several pictures and integrators of several layers: the first three channels are the colours.
    pixels = np.array(mi.render(loaded, spp=a.spp, seed=a.seed))[..., :3]
    mi.Bitmap(np.ascontiguousarray(pixels, np.float32)).write(a.output)


if __name__ == "__main__":
    main()
