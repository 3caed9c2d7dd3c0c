//! What is special about kinds and plugins, in plain English: what is not said by their parameters.

use pointillist::scene::mitsuba::FOREIGN_INTEGRATORS;

/// Kind, plugin (or nothing for the whole kind), what to say of it, as Markdown.
pub const NOTES: &[(&str, &str, &str)] = &[
    ("shape", "ply", "in text or binary, polygons too"),
    ("shape", "serialized", "of versions 3 and 4"),
    ("shape", "cylinder", "exact, also as a light and under any transform"),
    (
        "shape",
        "linearcurve",
        "exact, seen from outside only; a line `x y z radius` for each control point, an empty line between curves; `to_world` leaves \
         radii as they are; no light, no medium and no texture coordinates",
    ),
    ("shape", "bsplinecurve", "as `linearcurve`, with uniform cubic B-splines"),
    ("shape", "obj", "negative indices too; read by several threads"),
    ("shape", "merge", "another way to write shapes: it changes nothing that is seen"),
    ("shape", "shapegroup", "stored once, however many instances show it; it cannot hold emitters"),
    ("shape", "instance", "shows a `shapegroup`"),
    (
        "bsdf",
        "",
        "Rough materials sample visible normals only; `alpha_u` and `alpha_v` follow texture coordinates. \
         Metals by name (`material`) and media by name (`int_ior`, `ext_ior`) have their measured curves; \
         an `int_ior` that is a number disperses where `int_abbe` gives its Abbe number, which Mitsuba does not know.",
    ),
    (
        "bsdf",
        "null",
        "rays pass it, shadow rays too; what is passed does not count in `max_depth`, as in Mitsuba's `volpath`",
    ),
    (
        "bsdf",
        "blendbsdf",
        "at most four materials make one; a `weight` with a colour counts by its luminance",
    ),
    ("bsdf", "mask", "what is not there is passed as by `null`; what emits does so in full, as in Mitsuba"),
    (
        "bsdf",
        "mixturebsdf",
        "of version 0.6; at most four materials make one; what the weights leave of 1 is black and counts as a material",
    ),
    ("bsdf", "roughdiffuse", "of version 0.6; `alpha` is √2 times the σ of Oren and Nayar"),
    (
        "bsdf",
        "phong",
        "of version 0.6; an exponent above 1000000 counts as that; where the two reflectances add up to more than 1 both are scaled",
    ),
    (
        "bsdf",
        "ward",
        "of version 0.6; `variant` is `ward`, `ward-duer` or `balanced`, of which only the last never reflects more than arrives",
    ),
    ("bsdf", "difftrans", "of version 0.6"),
    (
        "bsdf",
        "coating",
        "of version 0.6; over any bsdf but another coat; its index counts at the sodium line; light that the coat throws back to the bsdf in it is \
         lost, as in version 0.6",
    ),
    ("bsdf", "roughcoating", "as `coating`; a texture of `alpha` counts by its mean"),
    ("bsdf", "pplastic", "light has no polarisation: rendered as `roughplastic`"),
    ("bsdf", "polarizer", "lets half of `transmittance` straight through, as of unpolarised light"),
    ("bsdf", "circular", "as `polarizer`"),
    ("bsdf", "retarder", "lets `transmittance` straight through, as of unpolarised light"),
    (
        "bsdf",
        "normalmap",
        "the map is a `bitmap`, best `raw`; by another name it is taken if it is the only texture; no light gets through an opaque surface, also where `flip_invalid_normals` is false",
    ),
    (
        "bsdf",
        "principled",
        "a film of `thin_film_thickness` nm (of a texture: the same unit) and relative index `thin_film_eta` covers `thin_film_weight` of its \
         facets, in which light interferes; Mitsuba does not know these three",
    ),
    (
        "bsdf",
        "bumpmap",
        "the map is a `bitmap`; in version 0.6 it may have any name; no map stands within another",
    ),
    ("bsdf", "roughplastic", "a texture of `alpha` counts by its mean"),
    (
        "texture",
        "bitmap",
        "PNG, JPEG, WebP, BMP, TGA, OpenEXR, Radiance, PFM, KTX2 (its largest level; BasisU or plain numbers); kept in the depth of the file; alpha is ignored",
    ),
    ("texture", "checkerboard", "where a number is wanted the colours are exchanged, as in Mitsuba 3.9.1"),
    (
        "texture",
        "mesh_attribute",
        "`vertex_NAME` or `face_NAME` of a `ply` or `serialized`; a material can use four numbers, of which a colour takes three",
    ),
    (
        "texture",
        "product",
        "two textures multiplied, which Mitsuba has not; its mean is the product of their means",
    ),
    (
        "texture",
        "volume",
        "the values of a <volume> where a surface lies in world space; of what an instance shows, where the instance shows it; not for what emits",
    ),
    (
        "volume",
        "gridvolume",
        "a `.vol` of version 3 of 32-bit or 16-bit floats or bytes (Mitsuba reads the first only); with one channel a number, with three a \
         colour, with others their mean counts; `tools/vdb_to_vol` makes one of a grid of OpenVDB",
    ),
    (
        "medium",
        "",
        "A shape names media as its `interior` and `exterior`, a sensor the one that it is in. Coefficients are per unit of length of the \
         scene, times `scale`. They are `sigma_t` and `albedo`, or `sigma_s` and `sigma_a`, or those of a `material` of Jensen et al. 2001 \
         (`apple`, `chicken1`, `chicken2`, `cream`, `ketchup`, `marble`, `potato`, `skimmilk`, `skin1`, `skin2`, `spectralon`, \
         `wholemilk`) in 1/mm; Mitsuba 3 knows `sigma_t` and `albedo` only. An `<rgb>` as `sigma_t` may be above 1, which Mitsuba's \
         spectral mode refuses. Mitsuba's media do not shine: `radiance` is that of an opaque layer, so that per unit of length a medium \
         emits its absorption coefficient times that, or that of a black body of `temperature` in K, in W m⁻² sr⁻¹ nm⁻¹ as \
         `blackbody` has it: one number, or a grid of them, in units of `temperature_scale`. `emission_scale` is a factor on either.",
    ),
    ("medium", "homogeneous", "the same everywhere"),
    (
        "medium",
        "heterogeneous",
        "`sigma_t`, `albedo`, `radiance`, under D65, and `temperature`, of one channel, may be a `gridvolume`; of version 0.6 \
         `density` is `sigma_t`",
    ),
    ("phase", "hg", "Henyey and Greenstein's; `g` above 0 is forwards"),
    (
        "phase",
        "tabphase",
        "a table over the cosine of the scattering angle, from -1, which is backwards, to 1 at equal steps; it is normalised",
    ),
    (
        "phase",
        "sggx",
        "microflakes in world space: a `gridvolume` of six channels, Sxx, Syy, Szz, Sxy, Sxz and Syz, or a `constvolume` whose \
         `value` is a `<string>` of six numbers, which Mitsuba 3.9.1 refuses; `sigma_t` is multiplied by the area that they \
         have seen along a ray, in a `blendphase`, too, where Mitsuba leaves it out",
    ),
    ("phase", "blendphase", "`weight` is the share of the second, one number; at most four make one"),
    (
        "emitter",
        "",
        "The medium around an emitter is the one in which it lies: a `<medium>` in it has no effect, with a remark.",
    ),
    (
        "emitter",
        "area",
        "emits from the front, as Mitsuba's does; a texture is unbounded, lit by D65 and importance-sampled",
    ),
    (
        "emitter",
        "directionalarea",
        "seen by `bidirectional`, `light` and, on surfaces with a diffuse part, `photon`; `path` shows none of it, as Mitsuba's",
    ),
    ("emitter", "projector", "its `to_world` only moves and turns"),
    (
        "emitter",
        "envmap",
        "OpenEXR, Radiance, PFM, PNG and JPEG; texels that are infinite, no number or negative count as 0, with a warning",
    ),
    ("emitter", "sunsky", "Hošek and Wilkie's spectral sky; the sun is equally bright all over"),
    ("emitter", "sky", "of version 0.6"),
    ("emitter", "sun", "of version 0.6"),
    (
        "sensor",
        "",
        "Every camera shows particles and paths from both ends, too, but for `radiancemeter` and `distant`, whose rays particles do not find. \
         `near_clip` and `far_clip` are planes for `perspective`, `thinlens`, `perspective_rdist` and `orthographic`, else distances along the ray. \
         Mitsuba 3 reads `perspective`, `thinlens`, `orthographic`, `radiancemeter`, `distant` and `batch`, Mitsuba 0.6 also `spherical` and \
         `perspective_rdist`; `fisheye`, `cubemap`, `ods` and the parameters `k1` to `k6`, `p1`, `p2`, `s1` to `s4`, `blades`, `blade_rotation`, `squeeze` \
         and `radius` are ours, which no other program reads. The coefficients are those of OpenCV's `projectPoints` (Brown–Conrady). For a \
         calibration with the focal length f and the principal point (cx, cy) in pixels, whose centres have whole numbers, and a film of W × H \
         pixels: `fov` along x is 2 atan(W / 2f), of a `fisheye` W / f in degrees, and `principal_point_offset_x` is ½ − (cx + ½) / W, with y likewise. What \
         lies beyond the fold of a distortion is not shown.",
    ),
    (
        "sensor",
        "thinlens",
        "a polygon of 3 to 64 `blades` (or `num_blades`) in the circle of the aperture, with a corner up and turned counter-clockwise by \
         `blade_rotation` degrees; `squeeze` makes the aperture narrower along x, as that of an anamorphic lens",
    ),
    ("sensor", "perspective_rdist", "of version 0.6; `kc` has the coefficients k1 and k2 of a `perspective`"),
    (
        "sensor",
        "fisheye",
        "`mapping` is `equidistant`, `equisolid`, `stereographic` or `orthographic`; `fov` is the full angle along `fov_axis` (`smaller` unless given) \
         without the distortion; black beyond the `image_circle`, a full angle, which is `fov` unless given, and 360 with `k1` to `k4`, the \
         coefficients of `cv2.fisheye` for the mapping `equidistant`",
    ),
    (
        "sensor",
        "spherical",
        "of version 0.6; all directions by longitude and latitude (equirectangular), ahead in the middle, for a film twice as wide as high",
    ),
    (
        "sensor",
        "cubemap",
        "`layout` is `3x2` (right, left, up; below down, front, back), `6x1` or `1x6` (right, left, up, down, front, back) or `cross` (4 × 3: left, \
         front, right, back, with up and down above and below the front); all faces are seen from within, up with its lower and down with \
         its upper edge at the front",
    ),
    (
        "sensor",
        "ods",
        "omnidirectional stereo: longitude and latitude as `spherical`, for `eyes` that are `interocular` apart: `both` (left above right, for a square \
         film), `left` or `right`",
    ),
    (
        "sensor",
        "radiancemeter",
        "every place of the picture shows the same ray, or the rays of a disk of this `radius`; it has no clip planes",
    ),
    (
        "sensor",
        "distant",
        "a shape as its `target` is refused; any film will do, whose places all show the mean",
    ),
    (
        "sensor",
        "irradiancemeter",
        "stands in the shape that it measures: a rectangle, a disk, or a sphere that is scaled alike along all axes; the picture shows the irradiance / π, any \
         place of it other directions",
    ),
    (
        "sensor",
        "batch",
        "its sensors show equal parts of the film from left to right; their films, samplers and media are not used; its `to_world`, which is ours, \
         moves all of them",
    ),
    (
        "film",
        "",
        "Any film is read: its size, crop and filter are used; what it writes is up to the command line.",
    ),
    (
        "rfilter",
        "",
        "Filters are splatted: a pixel is divided by the weights it got, which those with negative lobes could make zero. A tent \
         stands in for them. Without a filter the picture has a Gaussian of our own, a little wider than Mitsuba's.",
    ),
    ("rfilter", "mitchell", "a tent stands in for it"),
    ("rfilter", "catmullrom", "a tent stands in for it"),
    ("rfilter", "lanczos", "a tent stands in for it"),
    (
        "integrator",
        "",
        "Integrators of others are rendered by the method of ours that shows the same light, with a remark. One that holds \
         another, as `moment`, `adaptive` and `irrcache` do, is what it holds, with its depths; any other is `auto`, with a \
         warning. A `max_depth` of -1 is unlimited.",
    ),
    (
        "integrator",
        "aov",
        "its layers stand in the EXR file beside the picture, as those of `render --aov`; a shape's index counts from 1 in the order of \
         the file; surfaces that nobody sees, as the boundaries of media, are looked through; `transmittance` and `scattering_depth`, of \
         the media before the surface seen first, are ours, which Mitsuba does not know, as is `disparity`, for `render --stereo`",
    ),
    ("integrator", "depth", "the distance from the near plane, as grey"),
    ("integrator", "light", "the same as `ptracer`; Mitsuba does not know the name"),
    ("integrator", "bidirectional", "our own; Mitsuba does not know it"),
    (
        "integrator",
        "photon",
        "our own: `initial_radius` in scene units, `alpha` from 0 to 1 (how slowly the radius shrinks; 0), `lookup_size` in \
         photons per lookup (12)",
    ),
    (
        "integrator",
        "vcm",
        "our own: `bidirectional`, and photons as those of `photon` where no connection finds light",
    ),
    ("integrator", "auto", "our own: chooses the method by a short trial and says why"),
    ("sampler", "", "Any sampler is read for its sample count: the sequence is always ours."),
    (
        "spectrum",
        "",
        "Besides `<rgb>` `<srgb>` `<blackbody>` `<float>`, lists of `wavelength:value`, and `.spd` files. A `<texture>` may have \
         these types, too.",
    ),
    ("spectrum", "rawconstant", "the same as `uniform`"),
];

/// What to say of a plugin, or of a kind if `name` is empty; empty if nothing is special.
pub(super) fn of(kind: &str, name: &str) -> String {
    let written = NOTES.iter().find(|(k, n, _)| (*k, *n) == (kind, name)).map(|(_, _, note)| *note);
    let method = FOREIGN_INTEGRATORS.iter().find(|(n, _)| kind == "integrator" && *n == name);
    match (written, method) {
        (Some(note), _) => note.to_owned(),
        (None, Some((_, ours))) => format!("rendered by `{}`", ours.name()),
        (None, None) => String::new(),
    }
}
