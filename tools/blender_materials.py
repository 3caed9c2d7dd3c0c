"""Mitsuba's materials as Blender's shader nodes, and spectra as linear Rec.709; see blender_scene.py for what differs."""

import os

import numpy as np

# Angles at which a reflectance is integrated, and along each of two directions.
ANGLES, STEPS = 4096, 16


class Untranslatable(Exception):
    """Blender has no counterpart; the message says of what."""


class Spectra:
    """Spectra as linear Rec.709."""

    def __init__(self, mi):
        self.mi = mi
        self.wavelengths = np.arange(360.0, 831.0)
        self.observer = np.array([mi.cie1931_xyz(w) for w in self.wavelengths])
        self.d65 = np.array([mi.cie_d65(w) for w in self.wavelengths])

    def rgb(self, xyz):
        return np.array(self.mi.xyz_to_srgb(self.mi.Color3f(*xyz)), dtype=float).ravel()

    def reflectance(self, values):
        """The colour of this reflectance at `wavelengths` under D65."""
        light = self.d65[:, None] * self.observer
        return self.rgb(values @ light / light[:, 1].sum())

    def radiance(self, values):
        return self.rgb(values @ self.observer / self.observer[:, 1].sum())

    def file(self, path):
        rows = np.loadtxt(path, comments="#")
        return np.interp(self.wavelengths, rows[:, 0], rows[:, 1])

    def metal(self, name):
        """Complex index of a metal that Mitsuba knows by name."""
        folder = os.path.join(os.path.dirname(self.mi.__file__), "data", "ior")
        files = [os.path.join(folder, f"{name}.{part}.spd") for part in ("eta", "k")]
        if not all(map(os.path.exists, files)):
            raise Untranslatable(f"the metal {name!r} is not among those of Mitsuba")
        return tuple(map(self.file, files))


def conductor_reflectance(eta, k, cosine):
    """Unpolarised Fresnel reflectance of a metal in vacuum."""
    c2, s2 = cosine**2, 1 - cosine**2
    t0 = eta**2 - k**2 - s2
    a2b2 = np.sqrt(t0**2 + 4 * eta**2 * k**2)
    a = np.sqrt(np.maximum(0.5 * (a2b2 + t0), 0))
    rs = (a2b2 + c2 - 2 * a * cosine) / (a2b2 + c2 + 2 * a * cosine)
    rp = rs * (c2 * a2b2 + s2**2 - 2 * a * cosine * s2) / (c2 * a2b2 + s2**2 + 2 * a * cosine * s2)
    return 0.5 * (rs + rp)


def external_reflectance(ior):
    """The share of diffuse light that a smooth dielectric surface reflects."""
    cosine = (np.arange(ANGLES) + 0.5) / ANGLES
    inside = np.sqrt(1 - (1 - cosine**2) / ior**2)
    rs = (cosine - ior * inside) / (cosine + ior * inside)
    rp = (ior * cosine - inside) / (ior * cosine + inside)
    return (0.5 * (rs**2 + rp**2) * 2 * cosine).mean()


class Graph:
    """The shader nodes of one material. Methods return output sockets."""

    def __init__(self, translation, tree):
        self.of, self.tree = translation, tree
        tree.nodes.clear()

    def finish(self, surface):
        out = self.tree.nodes.new("ShaderNodeOutputMaterial")
        self.tree.links.new(surface, out.inputs["Surface"])

    def node(self, kind, inputs, **settings):
        """A node; each input is a constant or a socket."""
        node = self.tree.nodes.new(f"ShaderNode{kind}")
        for name, value in settings.items():
            setattr(node, name, value)
        for name, value in inputs.items():
            socket = node.inputs[name]
            if hasattr(value, "links"):
                self.tree.links.new(value, socket)
            elif socket.type == "RGBA":
                socket.default_value = (*np.ones(3) * value, 1)
            else:
                socket.default_value = value
        return node

    def diffuse(self, colour):
        return self.node("BsdfDiffuse", {"Color": colour, "Roughness": 0.0}).outputs[0]

    def emission(self, radiance):
        return self.node("Emission", {"Color": self.texture(radiance, True), "Strength": 1.0}).outputs[0]

    def add(self, a, b):
        return self.node("AddShader", {0: a, 1: b}).outputs[0]

    def mix(self, share, a, b):
        return self.node("MixShader", {0: share, 1: a, 2: b}).outputs[0]

    def back(self):
        return self.node("NewGeometry", {}).outputs["Backfacing"]

    def one_sided(self, front):
        return self.mix(self.back(), front, self.diffuse((0, 0, 0)))

    def vector(self, operation, a, b):
        return self.node("VectorMath", {0: a, 1: b}, operation=operation).outputs["Vector"]

    def math(self, operation, a, b):
        return self.node("Math", {0: a, 1: b}, operation=operation).outputs[0]

    def texture(self, value, emission=False):
        """A colour, or the socket of one."""
        of = self.of
        if not hasattr(value, "props") or value.props.plugin_name() in ("srgb", "d65", "uniform", "rawconstant"):
            return of.colour(value, emission)
        name = value.props.plugin_name()
        coordinates = self.node("UVMap", {}, uv_map="uv").outputs[0]
        to_uv = of.matrix(value, "to_uv")
        if to_uv.shape[0] > 3:
            to_uv = to_uv[np.ix_([0, 1, 3], [0, 1, 3])]
        if np.abs(to_uv - np.eye(3)).max() > 1e-9:
            if abs(to_uv[0, 1]) + abs(to_uv[1, 0]) > 1e-9:
                raise Untranslatable("a texture that is turned on its surface")
            (su, _, tu), (_, sv, tv), _ = to_uv
            # Rows are counted from below: v becomes 1 - v on both sides.
            place = {"Vector": coordinates, "Scale": (su, sv, 1), "Location": (tu, 1 - sv - tv, 0)}
            coordinates = self.node("Mapping", place, vector_type="POINT").outputs[0]
        if name == "bitmap":
            sampled = {"nearest": "Closest", "bilinear": "Linear"}[value.props.get("filter_type", "bilinear")]
            edge = {"repeat": "REPEAT", "clamp": "EXTEND", "mirror": "MIRROR"}[value.props.get("wrap_mode", "repeat")]
            image = of.image(value.props["filename"], value.props.get("raw", False))
            node = self.node("TexImage", {"Vector": coordinates}, image=image, interpolation=sampled, extension=edge)
            return node.outputs["Color"]
        if name == "checkerboard":
            # Both start with a square of color0 in the corner where u and v are 0.
            both = [of.named(value, "color0"), of.named(value, "color1")]
            c0, c1 = (default if c is None else of.colour(c) for c, default in zip(both, (0.4, 0.2)))
            raised = self.vector("ADD", coordinates, (0, 0, 0.25))
            return self.node("TexChecker", {"Vector": raised, "Color1": c0, "Color2": c1, "Scale": 2.0}).outputs["Color"]
        raise Untranslatable(f"texture {name}")

    def parameter(self, node, name, default):
        value = self.of.named(node, name)
        return np.ones(3) * default if value is None else self.texture(value)

    def index(self, node, default="bk7"):
        """The index of the inside over that of the outside, one for all wavelengths."""
        known = {"vacuum": 1.0, "air": 1.000277, "water": 1.333, "bk7": 1.5046, "polypropylene": 1.49, "diamond": 2.419}
        indices = []
        for name, other in (("int_ior", default), ("ext_ior", "air")):
            value = self.of.named(node, name)
            value = other if value is None else value
            if isinstance(value, str) and value not in known:
                raise Untranslatable(f"{name} {value}, which disperses: Cycles has no wavelengths")
            indices.append(known.get(value, value) if isinstance(value, str) else float(value))
        return indices[0] / indices[1]

    def roughness(self, node):
        """Blender's roughness and distribution, from Mitsuba's alpha, which is its square."""
        alpha, u, v = (self.of.number(node, name, d) for name, d in (("alpha", 0.1), ("alpha_u", None), ("alpha_v", None)))
        anisotropy, rotation = 0.0, 0.0
        if u is not None and v is not None and u != v:
            # Blender: aspect = sqrt(1 - 0.9 a), alpha_x = r^2 / aspect, alpha_y = r^2 * aspect.
            aspect2, alpha = min(u, v) / max(u, v), (u * v) ** 0.5
            anisotropy, rotation = min(1.0, (1 - aspect2) / 0.9), 0.0 if u >= v else 0.25
        elif u is not None:
            alpha = u
        kind = {"beckmann": "BECKMANN", "ggx": "GGX"}[node.props.get("distribution", "beckmann").lower()]
        return {"Roughness": alpha**0.5, "Anisotropy": anisotropy, "Rotation": rotation}, kind

    def metal(self, node, rough):
        of = self.of
        inputs, kind = self.roughness(node) if rough else ({"Roughness": 0.0}, "GGX")
        if "Anisotropy" in inputs and inputs["Anisotropy"]:
            inputs["Tangent"] = self.node("Tangent", {}, direction_type="UV_MAP", uv_map="uv").outputs[0]
        else:
            inputs = {"Roughness": inputs["Roughness"]}
        tint = self.parameter(node, "specular_reflectance", 1.0)
        name = of.named(node, "material")
        if name == "none":
            return self.node("BsdfAnisotropic", inputs | {"Color": tint}, distribution=kind).outputs[0]
        if name is None and "eta" not in node.props:
            name = "Cu"
        if name is not None:
            eta, k = of.spectra.metal(name)
        else:
            eta, k = of.named(node, "eta"), of.named(node, "k")
            if type(eta).__name__ == "Spectrum":
                eta, k = of.values(eta), of.values(k)
            else:
                eta, k = of.colour(eta), of.colour(k)
        whole = lambda cosine: conductor_reflectance(eta, k, cosine)
        seen = lambda r: of.spectra.reflectance(r) if len(r) > 3 else r
        # F82: Schlick's curve through the reflectance at 0 degrees, times the edge tint at 82.
        cosine = 1 / 7
        f0, f82 = np.clip(seen(whole(1.0)), 1e-4, 1), seen(whole(cosine))
        schlick = f0 + (1 - f0) * (1 - cosine) ** 5
        edge = np.clip(f82 / schlick, 0, 1)
        if hasattr(tint, "links"):
            raise Untranslatable("a metal with a picture as specular_reflectance")
        if np.allclose(tint, 1):
            inputs |= {"Base Color": f0, "Edge Tint": edge}
        else:
            # The tint scales the reflectance at all angles, which F82 cannot: its edge is always white.
            inputs |= {"Base Color": f0 * tint, "Edge Tint": np.clip(f82 * tint / (f0 * tint + (1 - f0 * tint) * (1 - cosine) ** 5), 0, 1)}
        return self.node("BsdfMetallic", inputs, fresnel_type="F82", distribution=kind).outputs[0]

    def glass(self, node, rough):
        ior = self.index(node)
        inputs, kind = self.roughness(node) if rough else ({"Roughness": 0.0}, "GGX")
        if inputs.get("Anisotropy"):
            raise Untranslatable("anisotropic glass")
        surface = {"Roughness": inputs["Roughness"]}
        reflected, passed = (self.parameter(node, f"specular_{n}", 1.0) for n in ("reflectance", "transmittance"))
        one = lambda c: not hasattr(c, "links") and np.allclose(c, 1)
        if one(reflected) and one(passed):
            return self.node("BsdfGlass", surface | {"IOR": ior, "Color": 1.0}, distribution=kind).outputs[0]
        share = self.node("Fresnel", {"IOR": ior}).outputs[0]
        through = self.node("BsdfRefraction", surface | {"IOR": ior, "Color": passed}, distribution=kind)
        mirror = self.node("BsdfAnisotropic", surface | {"Color": reflected}, distribution=kind)
        return self.mix(share, through.outputs[0], mirror.outputs[0])

    def thin_glass(self, node):
        ior = self.index(node)
        # The Fresnel node takes the reciprocal on the back, where a pane is no different.
        other = self.math("ADD", self.math("MULTIPLY", self.back(), 1 / ior - ior), ior)
        r = self.node("Fresnel", {"IOR": other}).outputs[0]
        share = self.math("DIVIDE", self.math("MULTIPLY", r, 2.0), self.math("ADD", r, 1.0))
        through = self.node("BsdfTransparent", {"Color": self.parameter(node, "specular_transmittance", 1.0)})
        mirror = self.node("BsdfAnisotropic", {"Roughness": 0.0, "Color": self.parameter(node, "specular_reflectance", 1.0)})
        return self.mix(share, through.outputs[0], mirror.outputs[0])

    def plastic(self, node, rough):
        """A diffuse part under a dielectric one. Its mean albedo over all directions is that of Mitsuba's."""
        ior = self.index(node, "polypropylene")
        inputs, _ = self.roughness(node) if rough else ({"Roughness": 0.0}, "GGX")
        first, inside = self.under_plastic(node, ior)
        colour, through = self.parameter(node, "diffuse_reflectance", 0.5), 1 - external_reflectance(ior)
        if not node.props.get("nonlinear", False):
            first, inside = first / (1 - inside), 0.0
        # Light that is thrown back inside meets the colour again.
        if hasattr(colour, "links"):
            once = self.vector("MULTIPLY", colour, (first / through,) * 3)
            colour = self.vector("DIVIDE", once, self.vector("SUBTRACT", (1, 1, 1), self.vector("MULTIPLY", colour, (inside,) * 3)))
        else:
            colour = colour * first / through / (1 - colour * inside)
        gloss = self.parameter(node, "specular_reflectance", 1.0)
        if rough:
            # The mix below takes the reflectance at the surface's normal; this one takes it at each facet's.
            layers = {"Base Color": colour, "Roughness": inputs["Roughness"], "IOR": ior, "Specular Tint": gloss}
            return self.node("BsdfPrincipled", layers, distribution="GGX").outputs[0]
        mirror = self.node("BsdfAnisotropic", {"Roughness": 0.0, "Color": gloss}).outputs[0]
        return self.mix(self.node("Fresnel", {"IOR": ior}).outputs[0], self.diffuse(colour), mirror)

    def under_plastic(self, node, ior):
        """Of Mitsuba's plastic: the share of light that comes back after one meeting with white, and the internal reflectance."""
        mi, albedo = self.of.mi, []
        for colour in (1e-3, 1.0):
            same = {"type": node.props.plugin_name(), "int_ior": ior, "ext_ior": 1.0, "nonlinear": True, "diffuse_reflectance": colour}
            if node.props.plugin_name() == "roughplastic":
                same |= {"alpha": self.of.number(node, "alpha", 0.1), "distribution": node.props.get("distribution", "beckmann")}
            bsdf = mi.load_dict(same | {"specular_reflectance": 0.0})
            context, at = mi.BSDFContext(), mi.SurfaceInteraction3f()
            cosines = (np.arange(STEPS) + 0.5) / STEPS
            total = 0.0
            for i in cosines:
                at.wi = [float((1 - i * i) ** 0.5), 0.0, float(i)]
                # eval() holds the cosine of the other side.
                total += sum(bsdf.eval(context, at, [0.0, float((1 - o * o) ** 0.5), float(o)])[0] * i for o in cosines)
            albedo.append(4 * np.pi * total / STEPS**2 / colour)
        inside = (1 - albedo[0] / albedo[1]) / (1 - 1e-3 * albedo[0] / albedo[1])
        return albedo[0] * (1 - 1e-3 * inside), inside

    def principled(self, node):
        number = lambda name, default: self.of.number(node, name, default)
        unlike = [n for n in ("sheen", "clearcoat", "flatness", "spec_tint") if number(n, 0.0)]
        if unlike:
            raise Untranslatable(f"principled with {unlike[0]}")
        inputs = {
            "Base Color": self.parameter(node, "base_color", 0.5),
            "Metallic": number("metallic", 0.0),
            "Roughness": number("roughness", 0.5),
            "Transmission Weight": number("spec_trans", 0.0),
            "Anisotropic": number("anisotropic", 0.0),
        }
        if "eta" in node.props:
            inputs["IOR"] = number("eta", 1.5)
        else:
            inputs |= {"IOR": 1.5, "Specular IOR Level": number("specular", 0.5)}
        return self.node("BsdfPrincipled", inputs, distribution="GGX").outputs[0]

    def bsdf(self, node, two_sided=False):
        name, inner = node.props.plugin_name(), self.of.children(node, "BSDF")
        if name == "twosided":
            if len(inner) == 1:
                return self.bsdf(inner[0], True)
            return self.mix(self.back(), *(self.bsdf(side, True) for side in inner[:2]))
        if name in ("dielectric", "roughdielectric"):
            return self.glass(node, name.startswith("rough"))
        if name == "thindielectric":
            return self.thin_glass(node)
        if name == "null":
            return self.node("BsdfTransparent", {"Color": 1.0}).outputs[0]
        if name == "mask":
            share = self.parameter(node, "opacity", 0.5)
            share = share if hasattr(share, "links") else float(np.mean(share))
            return self.mix(share, self.node("BsdfTransparent", {"Color": 1.0}).outputs[0], self.bsdf(inner[0], two_sided))
        if name == "blendbsdf":
            share = self.parameter(node, "weight", 0.5)
            share = share if hasattr(share, "links") else float(np.mean(share))
            return self.mix(share, *(self.bsdf(side, two_sided) for side in inner[:2]))
        if name == "diffuse":
            surface = self.diffuse(self.parameter(node, "reflectance", 0.5))
        elif name in ("conductor", "roughconductor"):
            surface = self.metal(node, name.startswith("rough"))
        elif name in ("plastic", "roughplastic"):
            surface = self.plastic(node, name.startswith("rough"))
        elif name == "principled":
            if self.of.number(node, "spec_trans", 0.0):
                return self.principled(node)
            surface = self.principled(node)
        else:
            raise Untranslatable(f"bsdf {name}")
        return surface if two_sided else self.one_sided(surface)
