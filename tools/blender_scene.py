"""Renders a Mitsuba XML scene with Blender's Cycles, for tools/shown.

Mitsuba's own parser reads the file, so that references, defaults and relative paths mean the same to all. Geometry keeps its
coordinates. What Blender has no counterpart for raises Untranslatable with one line that says what it is.

Where the two differ by design:
  Spectra become linear Rec.709: reflectances as seen under D65, radiances as they are.
  Spheres, disks and cylinders become smooth meshes. Rectangles, disks and spheres that shine become lamps, which Cycles
    samples better than meshes, right before a surface that only reflects.
  Metals take Blender's F82 model, fitted to the spectral reflectance at 0 and 82 degrees.
  `plastic` becomes a Fresnel mix of a glossy and a diffuse part, `roughplastic` Blender's Principled BSDF, which has GGX only; the
    mean albedo of the diffuse part is Mitsuba's.
  `principled` becomes Blender's Principled BSDF.
  Materials that are not `twosided` are black from behind, and area lights shine to the front only, as in Mitsuba.
  Participating media are left out, as by Pointillist.

As a program it reads one JSON object per line and answers with one. `serve()` says what it understands.
"""

import argparse
import json
import os
import sys
import time
import warnings

import numpy as np

from blender_materials import Graph, Spectra, Untranslatable

# Segments of the meshes that stand for round shapes, around and from pole to pole.
AROUND, POLE_TO_POLE = 256, 128
# Of a light, which is mostly small, and whose triangles are all sampled.
LIGHT_AROUND, LIGHT_POLE_TO_POLE = 64, 32
# A lamp is so far before its surface, over its size.
LAMP_GAP = 1e-4
# Bounces that stand for an unlimited path.
UNLIMITED = 1024


# Geometry: vertices, triangles, and where there are some normals and texture coordinates per vertex.


def grid(rows, columns):
    """Triangles of a grid of vertices, row by row."""
    i, j = (a.ravel() for a in np.meshgrid(np.arange(rows - 1), np.arange(columns - 1), indexing="ij"))
    a = i * columns + j
    b, c, d = a + 1, a + columns, a + columns + 1
    return np.concatenate([np.stack([a, c, b], 1), np.stack([b, c, d], 1)])


def sphere_mesh(around, steps):
    theta, phi = np.meshgrid(np.linspace(0, np.pi, steps + 1), np.linspace(0, 2 * np.pi, around + 1), indexing="ij")
    points = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1).reshape(-1, 3)
    uv = np.stack([phi / (2 * np.pi), theta / np.pi], -1).reshape(-1, 2)
    faces = grid(steps + 1, around + 1)
    # At the poles every other triangle has no area.
    p = points[faces]
    area = np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1)
    return points, faces[area > 1e-9], points, uv


def cylinder_mesh(around):
    phi, z = np.meshgrid(np.linspace(0, 2 * np.pi, around + 1), [0.0, 1.0])
    phi, z = phi.ravel(), z.ravel()
    normals = np.stack([np.cos(phi), np.sin(phi), 0 * phi], 1)
    faces = grid(2, around + 1)[:, ::-1]
    return normals + np.outer(z, [0, 0, 1]), faces, normals, np.stack([phi / (2 * np.pi), z], 1)


def disk_mesh(around):
    phi = np.linspace(0, 2 * np.pi, around + 1)
    rim = np.stack([np.cos(phi), np.sin(phi), 0 * phi], 1)
    points = np.concatenate([[[0, 0, 0]], rim])
    i = np.arange(1, around + 1)
    uv = np.concatenate([[[0, 0]], np.stack([1 + 0 * phi, phi / (2 * np.pi)], 1)])
    return points, np.stack([0 * i, i, i + 1], 1), None, uv


class Translation:
    """A Mitsuba scene in Blender."""

    def __init__(self, mi, bpy, path, defines, size):
        self.mi, self.bpy, self.path = mi, bpy, path
        self.folder = os.path.dirname(os.path.abspath(path))
        self.spectra = Spectra(mi)
        config = mi.parser.ParserConfig(mi.variant())
        self.state = mi.parser.parse_file(config, path, **defines)
        mi.parser.transform_upgrade(config, self.state)
        mi.parser.transform_resolve_references(config, self.state)
        self.materials, self.groups = {}, {}
        bpy.ops.wm.read_factory_settings(use_empty=True)
        self.scene, self.depth = bpy.context.scene, -1
        self.scene.render.resolution_x, self.scene.render.resolution_y = size
        self.world()
        for node in self.children(self.state.root):
            kind = str(node.type).split(".")[-1].lower()
            if kind == "shape":
                self.shape(node)
            elif kind == "sensor":
                self.camera(node)
            elif kind == "emitter":
                self.emitter(node)
            elif kind == "integrator":
                self.depth = node.props.get("max_depth", -1)

    # The tree of the file

    def children(self, node, kind=None):
        """The nodes that this one refers to, of one kind if it is named."""
        values = [node.props[key] for key in node.props.keys()]
        nodes = [self.state.nodes[v.index()] for v in values if type(v).__name__ == "ResolvedReference"]
        return [n for n in nodes if kind is None or str(n.type).endswith("." + kind)]

    def child(self, node, kind):
        found = self.children(node, kind)
        return found[0] if found else None

    def named(self, node, name):
        """A parameter: a number, a string, a Color3d, a Spectrum or the node of a texture."""
        if name not in node.props:
            return None
        value = node.props[name]
        return self.state.nodes[value.index()] if type(value).__name__ == "ResolvedReference" else value

    def matrix(self, node, name="to_world"):
        transform = self.named(node, name)
        return np.eye(4) if transform is None else np.array(transform.matrix, dtype=float)

    def point(self, node, name, default):
        return np.array(node.props[name] if name in node.props else default, dtype=float).ravel()

    def colour(self, value, emission=False):
        """A constant spectrum as linear Rec.709."""
        kind = type(value).__name__
        if kind in ("int", "float"):
            # A number is a flat spectrum.
            return np.ones(3) * value if not emission else self.spectra.radiance(np.ones(471) * value)
        if kind == "Color3d":
            return np.array(value, dtype=float).ravel()
        if kind == "Spectrum":
            values = self.values(value)
            return self.spectra.radiance(values) if emission else self.spectra.reflectance(values)
        name = value.props.plugin_name()
        if name in ("srgb", "d65"):
            colour = self.named(value, "color")
            return np.ones(3) * value.props.get("scale", 1.0) * (1 if colour is None else self.colour(colour))
        if name in ("uniform", "rawconstant"):
            return self.colour(float(value.props.get("value", 1.0)), emission)
        raise Untranslatable(f"a {name} where one colour is needed")

    def values(self, spectrum):
        """A Spectrum at all wavelengths."""
        if spectrum.is_uniform():
            return np.ones(471) * spectrum.values[0]
        inside = np.interp(self.spectra.wavelengths, spectrum.wavelengths, spectrum.values)
        ends = (self.spectra.wavelengths >= spectrum.wavelengths[0]) & (self.spectra.wavelengths <= spectrum.wavelengths[-1])
        return inside * ends

    def number(self, node, name, default):
        value = self.named(node, name)
        if value is None:
            return default
        if isinstance(value, (int, float)):
            return float(value)
        raise Untranslatable(f"{name} of {node.props.plugin_name()} is not a number")

    # Camera and lights

    def camera(self, node):
        name = node.props.plugin_name()
        if name not in ("perspective", "thinlens"):
            raise Untranslatable(f"sensor {name}")
        data = self.bpy.data.cameras.new("camera")
        fov, axis = self.number(node, "fov", 39.3077), node.props.get("fov_axis", "x")
        if "focal_length" in node.props:
            raise Untranslatable("focal_length; write fov instead")
        # Blender's AUTO measures along the longer side.
        fits = {"x": "HORIZONTAL", "y": "VERTICAL", "larger": "AUTO"}
        width, height = self.scene.render.resolution_x, self.scene.render.resolution_y
        fits["smaller"] = "VERTICAL" if width > height else "HORIZONTAL"
        if axis not in fits:
            raise Untranslatable(f"fov_axis {axis}")
        data.sensor_fit = fits[axis]
        data.sensor_width = data.sensor_height = 36
        data.lens = 18 / np.tan(np.radians(fov) / 2)
        data.clip_start, data.clip_end = node.props.get("near_clip", 0.01), 1e6
        for name in ("principal_point_offset_x", "principal_point_offset_y"):
            if self.number(node, name, 0.0):
                raise Untranslatable(name)
        if name == "thinlens":
            data.dof.use_dof = True
            data.dof.focus_distance = self.number(node, "focus_distance", 10000.0)
            # The lens in metres, half of it per f-stop.
            data.dof.aperture_fstop = data.lens / 1000 / (2 * self.number(node, "aperture_radius", 0.0))
        camera = self.bpy.data.objects.new("camera", data)
        # Mitsuba looks along +z with +x to the left, Blender along -z with +x to the right.
        to_world = self.matrix(node) @ np.diag([-1.0, 1, -1, 1])
        to_world[:3, :3] /= np.linalg.norm(to_world[:3, :3], axis=0)
        self.place(camera, to_world)
        self.scene.camera = camera

    def world(self):
        self.scene.world = self.bpy.data.worlds.new("world")
        self.sky = self.tree(self.scene.world)
        self.sky.nodes.clear()
        self.background = self.sky.nodes.new("ShaderNodeBackground")
        self.background.inputs["Color"].default_value = (0, 0, 0, 1)
        out = self.sky.nodes.new("ShaderNodeOutputWorld")
        self.sky.links.new(self.background.outputs[0], out.inputs["Surface"])

    def emitter(self, node):
        name = node.props.plugin_name()
        if name == "constant":
            colour = self.colour(self.named(node, "radiance"), emission=True)
            self.background.inputs["Color"].default_value = (*colour, 1)
        elif name == "envmap":
            self.envmap(node)
        elif name == "point":
            # Blender's watts: 4 pi for the sphere and pi for a lambertian surface.
            place = np.eye(4)
            place[:3, 3] = self.point(node, "position", self.matrix(node)[:3, 3])
            self.lamp("POINT", place, self.colour(self.named(node, "intensity"), True), 4 * np.pi**2)
        elif name == "directional":
            direction = self.point(node, "direction", self.matrix(node)[:3, 2])
            self.lamp("SUN", look_along(direction), self.colour(self.named(node, "irradiance"), True), 1.0)
        else:
            raise Untranslatable(f"emitter {name}")

    def lamp(self, kind, to_world, colour, energy):
        light = self.bpy.data.lights.new(kind, kind)
        scale = max(colour.max(), 1e-30)
        light.color, light.energy = colour / scale, energy * scale
        if kind == "SUN":
            light.angle = 0
        else:
            light.shadow_soft_size = 0
        lamp = self.bpy.data.objects.new(kind, light)
        self.place(lamp, to_world)
        return lamp

    def envmap(self, node):
        nodes, links = self.sky.nodes, self.sky.links
        texture = nodes.new("ShaderNodeTexEnvironment")
        texture.image = self.image(node.props["filename"], raw=node.props["filename"].lower().endswith((".exr", ".hdr", ".pfm")))
        # Mitsuba's u is atan2(x, -z) / 2 pi around +y, Blender's 1/2 - atan2(y, x) / 2 pi around +z.
        cycle = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])
        to_local = np.linalg.inv(self.matrix(node)[:3, :3])
        coordinates, vector = nodes.new("ShaderNodeTexCoord"), nodes.new("ShaderNodeCombineXYZ")
        for i, row in enumerate(cycle @ to_local):
            dot = nodes.new("ShaderNodeVectorMath")
            dot.operation = "DOT_PRODUCT"
            dot.inputs[1].default_value = row
            links.new(coordinates.outputs["Generated"], dot.inputs[0])
            links.new(dot.outputs["Value"], vector.inputs[i])
        links.new(vector.outputs[0], texture.inputs["Vector"])
        links.new(texture.outputs["Color"], self.background.inputs["Color"])
        self.background.inputs["Strength"].default_value = self.number(node, "scale", 1.0)

    # Shapes

    def place(self, thing, to_world):
        import mathutils

        self.scene.collection.objects.link(thing)
        thing.matrix_world = mathutils.Matrix([list(map(float, row)) for row in to_world])

    def shape(self, node):
        name = node.props.plugin_name()
        if name == "shapegroup":
            return
        if name == "merge":
            for inner in self.children(node, "Shape"):
                self.shape(inner)
        elif name == "instance":
            group = self.child(node, "Shape")
            key = (group.file_index, group.offset)
            if key not in self.groups:
                self.groups[key] = [self.mesh(inner) for inner in self.children(group, "Shape")]
            for mesh in self.groups[key]:
                self.place(self.bpy.data.objects.new("instance", mesh), self.matrix(node))
        else:
            self.light(node)
            self.place(self.bpy.data.objects.new(node.props.id() or name, self.mesh(node)), np.eye(4))

    def lamp_shape(self, node):
        """Blender's lamp for a shape that shines in one colour: its kind, its place and size, and its area times pi."""
        emitter, name, m = self.child(node, "Emitter"), node.props.plugin_name(), self.matrix(node)
        if emitter is None or name not in ("rectangle", "disk", "sphere") or node.props.get("flip_normals", False):
            return None
        if hasattr(self.named(emitter, "radiance"), "props"):
            return None
        sizes = np.linalg.norm(m[:3, :3], axis=0)
        axes = m[:3, :3] / sizes
        if np.abs(axes.T @ axes - np.eye(3)).max() > 1e-4 or np.linalg.det(axes) < 0:
            return None
        place = np.eye(4)
        if name == "sphere":
            centre = self.point(node, "center", [0, 0, 0])
            radius = self.number(node, "radius", 1.0) * sizes[0]
            place[:3, 3] = m[:3, :3] @ centre + m[:3, 3]
            return ("POINT", place, (radius,), 4 * np.pi**2 * radius**2) if np.ptp(sizes) < 1e-4 * sizes[0] else None
        # Blender's lamps shine along -z. This one stands before its surface by a little.
        place[:3, :3] = axes * [1, -1, -1]
        place[:3, 3] = m[:3, 3] + axes[:, 2] * LAMP_GAP * sizes[:2].max()
        area = sizes[0] * sizes[1] * (4 if name == "rectangle" else np.pi)
        return "RECTANGLE" if name == "rectangle" else "ELLIPSE", place, 2 * sizes[:2], np.pi * area

    def light(self, node):
        """Adds the lamp of a shape that shines. Its surface, a little behind, then only reflects: lamps let rays pass."""
        shape = self.lamp_shape(node)
        if shape is None:
            return
        kind, place, size, scale = shape
        radiance = self.colour(self.named(self.child(node, "Emitter"), "radiance"), emission=True)
        lamp = self.lamp("POINT" if kind == "POINT" else "AREA", place, radiance, scale)
        lamp.visible_camera = True
        if kind == "POINT":
            lamp.data.shadow_soft_size, lamp.data.use_soft_falloff = size[0], False
        else:
            lamp.data.shape, lamp.data.size, lamp.data.size_y = kind, *size

    def geometry(self, node):
        """Vertices, triangles, normals and texture coordinates in the space of the shape's parent."""
        name, light = node.props.plugin_name(), self.child(node, "Emitter") is not None
        around, steps = (LIGHT_AROUND, LIGHT_POLE_TO_POLE) if light else (AROUND, POLE_TO_POLE)
        to_world = self.matrix(node)
        if name == "sphere":
            parts = sphere_mesh(around, steps)
            centre = self.point(node, "center", [0, 0, 0])
            radius = self.number(node, "radius", 1.0) * (1 - LAMP_GAP if self.lamp_shape(node) else 1)
            to_world = to_world @ move(centre) @ np.diag([radius, radius, radius, 1])
        elif name == "disk":
            parts = disk_mesh(around)
        elif name == "cylinder":
            parts = cylinder_mesh(around)
            p0, p1 = self.point(node, "p0", [0, 0, 0]), self.point(node, "p1", [0, 0, 1])
            radius = self.number(node, "radius", 1.0)
            to_world = to_world @ move(p0) @ look_along(p0 - p1) @ np.diag([radius, radius, np.linalg.norm(p1 - p0), 1])
        elif name == "rectangle":
            corners = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
            parts = corners, np.array([[0, 1, 2], [0, 2, 3]]), None, (corners[:, :2] + 1) / 2
        elif name in ("obj", "ply", "serialized", "cube"):
            return self.loaded(node)
        else:
            raise Untranslatable(f"shape {name}")
        points, faces, normals, uv = parts
        points = points @ to_world[:3, :3].T + to_world[:3, 3]
        if normals is not None:
            normals = normals @ np.linalg.inv(to_world[:3, :3])
            normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        if (np.linalg.det(to_world[:3, :3]) < 0) != bool(node.props.get("flip_normals", False)):
            faces = faces[:, ::-1]
        return points, faces, normals, uv

    def loaded(self, node):
        """A mesh as Mitsuba loads it."""
        description = {"type": node.props.plugin_name()}
        for key in ("face_normals", "flip_tex_coords", "flip_normals", "to_world", "shape_index"):
            if key in node.props:
                value = node.props[key]
                description[key] = self.mi.ScalarTransform4f(value.matrix) if key == "to_world" else value
        if "filename" in node.props:
            description["filename"] = self.file(node.props["filename"])
        mesh = self.mi.load_dict(description)
        values = self.mi.traverse(mesh)
        points, faces = np.array(values["vertex_positions"]).reshape(-1, 3), np.array(values["faces"]).reshape(-1, 3)
        of_vertices = {"normals": None, "texcoords": None}
        for kind, columns in (("normals", 3), ("texcoords", 2)):
            found = np.array(values[f"vertex_{kind}"]) if f"vertex_{kind}" in values else np.empty(0)
            if len(found) == len(points) * columns:
                of_vertices[kind] = found.reshape(-1, columns)
        normals = of_vertices["normals"]
        # A cube has normals by the side, which its faces have anyway.
        if node.props.get("face_normals", False) or node.props.plugin_name() == "cube" or normals is None or not normals.any():
            normals = None
        return points, faces, normals, of_vertices["texcoords"]

    def mesh(self, node):
        points, faces, normals, uv = self.geometry(node)
        mesh = self.bpy.data.meshes.new(node.props.id() or node.props.plugin_name())
        mesh.vertices.add(len(points))
        mesh.vertices.foreach_set("co", np.ascontiguousarray(points, dtype=np.float32).ravel())
        mesh.loops.add(faces.size)
        corners = np.ascontiguousarray(faces, dtype=np.int32).ravel()
        mesh.loops.foreach_set("vertex_index", corners)
        mesh.polygons.add(len(faces))
        mesh.polygons.foreach_set("loop_start", np.arange(0, faces.size, 3, dtype=np.int32))
        if uv is not None:
            # Blender counts the rows of a picture from below.
            per_corner = np.stack([uv[:, 0], 1 - uv[:, 1]], 1)[corners].astype(np.float32)
            mesh.uv_layers.new(name="uv").data.foreach_set("uv", per_corner.ravel())
        mesh.update(calc_edges=True)
        if normals is not None:
            mesh.shade_smooth()
            mesh.normals_split_custom_set_from_vertices(np.ascontiguousarray(normals, dtype=np.float32))
        else:
            mesh.shade_flat()
        mesh.materials.append(self.material(node))
        return mesh

    # Materials

    def tree(self, thing):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)
            thing.use_nodes = True
        return thing.node_tree

    def file(self, name):
        path = os.path.join(self.folder, name.replace("\\", "/"))
        if not os.path.exists(path):
            raise Untranslatable(f"there is no file {path}")
        return path

    def image(self, name, raw):
        image = self.bpy.data.images.load(self.file(name), check_existing=True)
        image.colorspace_settings.name = "Non-Color" if raw else "sRGB"
        return image

    def material(self, shape):
        bsdf, light = self.child(shape, "BSDF"), self.child(shape, "Emitter")
        dark = self.lamp_shape(shape) is not None
        key = tuple(None if node is None else (node.file_index, node.offset) for node in (bsdf, light)) + (dark,)
        if key not in self.materials:
            self.materials[key] = self.new_material(bsdf, light, dark)
        return self.materials[key]

    def new_material(self, bsdf, light, dark):
        """The material of a shape. `dark`: a lamp shines in its place."""
        material = self.bpy.data.materials.new("material")
        graph = Graph(self, self.tree(material))
        if bsdf is not None:
            surface = graph.bsdf(bsdf)
        elif light is None:
            surface = graph.one_sided(graph.diffuse((0.5, 0.5, 0.5)))
        else:
            surface = graph.diffuse((0, 0, 0)) if dark else None
        if light is not None and not dark:
            if light.props.plugin_name() != "area":
                raise Untranslatable(f"emitter {light.props.plugin_name()}")
            shine = graph.one_sided(graph.emission(self.named(light, "radiance")))
            surface = shine if surface is None else graph.add(surface, shine)
            material.cycles.emission_sampling = "FRONT"
        else:
            material.cycles.emission_sampling = "NONE"
        graph.finish(surface)
        return material


def move(by):
    m = np.eye(4)
    m[:3, 3] = by
    return m


def look_along(direction):
    """A rotation whose -z axis points this way."""
    z = -np.array(direction, dtype=float) / np.linalg.norm(direction)
    x = np.cross([0.0, 1, 0] if abs(z[1]) < 0.9 else [1.0, 0, 0], z)
    x /= np.linalg.norm(x)
    m = np.eye(4)
    m[:3, :3] = np.stack([x, np.cross(z, x), z], 1)
    return m


# Rendering


def prepare(scene, depth, size, threads):
    """Settings under which Cycles is unbiased, with a box filter."""
    render, cycles = scene.render, scene.cycles
    render.engine = "CYCLES"
    render.resolution_x, render.resolution_y, render.resolution_percentage = *size, 100
    render.threads_mode, render.threads = "FIXED", threads
    # The second and later renders do not build the tree of triangles again.
    render.use_persistent_data = True
    cycles.device, cycles.use_adaptive_sampling = "CPU", False
    cycles.pixel_filter_type, cycles.filter_width = "BOX", 1.0
    bounces = UNLIMITED if depth < 0 else max(depth - 2, 0)
    cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = cycles.transmission_bounces = bounces
    cycles.transparent_max_bounces = UNLIMITED
    cycles.caustics_reflective = cycles.caustics_refractive = True
    cycles.blur_glossy = cycles.sample_clamp_direct = cycles.sample_clamp_indirect = cycles.light_sampling_threshold = 0.0
    cycles.denoiser, cycles.denoising_prefilter = "OPENIMAGEDENOISE", "ACCURATE"
    cycles.denoising_input_passes, cycles.denoising_quality = "RGB_ALBEDO_NORMAL", "HIGH"
    cycles.denoising_use_gpu = False


def settings_of_file(scene, layers):
    """One picture, or all that Cycles makes in one part, which is what other programs read."""
    image = scene.render.image_settings
    image.media_type = "MULTI_LAYER_IMAGE" if layers else "IMAGE"
    image.file_format = "OPEN_EXR_MULTILAYER" if layers else "OPEN_EXR"
    image.color_depth, image.exr_codec, image.use_exr_interleave = "32", "ZIP", True
    scene.view_layers[0].cycles.denoising_store_passes = layers


def serve(bpy, scene, requests, answer):
    """{"spp": 4, "seed": 1, "denoise": true, "out": "a.exr"} renders, and is answered by {"seconds": processor seconds}.
    With "layers": true the file also holds the picture before it was denoised, and the time includes writing."""
    for line in requests:
        wish = json.loads(line)
        cycles, layers = scene.cycles, wish.get("layers", False)
        cycles.samples, cycles.seed, cycles.use_denoising = wish["spp"], wish["seed"], wish["denoise"]
        settings_of_file(scene, layers)
        scene.render.filepath = wish.get("out") or ""
        start = time.process_time()
        bpy.ops.render.render(write_still=layers)
        seconds = time.process_time() - start
        if wish.get("out") and not layers:
            bpy.data.images["Render Result"].save_render(wish["out"])
        answer({"seconds": seconds})


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene")
    parser.add_argument("--size", default="512x512")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("-D", dest="define", action="append", default=[], metavar="NAME=VALUE")
    a = parser.parse_args()
    # Blender writes to standard output what is no answer.
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)

    def answer(what):
        print(json.dumps(what), file=answers, flush=True)

    import bpy
    import mitsuba as mi

    mi.set_variant("scalar_rgb")
    mi.set_log_level(mi.LogLevel.Error)
    size = [int(n) for n in a.size.split("x")]
    try:
        start = time.monotonic()
        translated = Translation(mi, bpy, a.scene, dict(d.split("=", 1) for d in a.define), size)
        scene = translated.scene
        prepare(scene, translated.depth, size, a.threads)
        answer({"ready": time.monotonic() - start})
    except (Untranslatable, RuntimeError) as e:
        answer({"untranslatable": " ".join(str(e).split())})
        sys.exit(3)
    serve(bpy, scene, sys.stdin, answer)


if __name__ == "__main__":
    main()
