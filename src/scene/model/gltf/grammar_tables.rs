//! The properties of each kind of object in a glTF file (specification 2.0, §5), and the extensions of each kind.

use super::grammar::Rule;
use super::grammar::Rule::{
    Boolean, Code, Index, Kept, List, Number, Numbers, Object, Share, Shares, Silent, Text, Told, Whole, Word,
};
use super::meshopt;
use super::textures::{CLAMP, LINEAR, MIRROR, NEAREST, REPEAT};

/// Kinds whose properties have free names: there `name`, `extras` and `extensions` mean nothing.
pub(super) const MAPS: &[&str] = &["attributes", "target", "instances"];

/// Extensions of any object that are not about the picture.
pub(super) const INNOCENT: &[&str] = &["KHR_xmp_json_ld", "KHR_xmp"];

/// Properties without which an object that the crate does not check means nothing.
pub(super) const REQUIRED: &[(&str, &str)] = &[
    ("textureInfo", "index"),
    ("normalTexture", "index"),
    ("KHR_texture_basisu", "source"),
    ("EXT_texture_webp", "source"),
    ("EXT_mesh_gpu_instancing", "attributes"),
    ("compressed primitive", "attributes"),
    ("compressed primitive", "bufferView"),
    ("compressed view", "buffer"),
    ("compressed view", "byteLength"),
    ("compressed view", "byteStride"),
    ("compressed view", "count"),
    ("compressed view", "mode"),
];

const TRANSFORMED: Rule = Object("KHR_texture_transform");
const FALLBACK: Rule = Told("it is not supported, and the data that stand in for it are shown");
const TANGENTS: Rule = Told("tangents follow from the texture coordinates");

/// Properties by the kind of their object. A name that ends in `#` stands for all with a number in its place.
pub(super) const KINDS: &[(&str, &[(&str, Rule)])] = &[
    (
        "file",
        &[
            ("accessors", List("accessor")),
            ("animations", Told("nothing moves, the model is shown as its nodes stand")),
            ("asset", Object("asset")),
            ("bufferViews", List("bufferView")),
            ("buffers", List("buffer")),
            ("cameras", List("camera")),
            ("extensionsRequired", Kept),
            ("extensionsUsed", Kept),
            ("images", List("image")),
            ("materials", List("material")),
            ("meshes", List("mesh")),
            ("nodes", List("node")),
            ("samplers", List("sampler")),
            ("scene", Kept),
            ("scenes", List("scene")),
            ("skins", List("skin")),
            ("textures", List("texture")),
        ],
    ),
    ("asset", &[("copyright", Silent), ("generator", Silent), ("minVersion", Kept), ("version", Kept)]),
    ("scene", &[("nodes", Kept)]),
    (
        "node",
        &[
            ("camera", Kept),
            ("children", Kept),
            ("matrix", Kept),
            ("mesh", Kept),
            ("rotation", Kept),
            ("scale", Kept),
            ("skin", Kept),
            ("translation", Kept),
            ("weights", Kept),
        ],
    ),
    ("mesh", &[("primitives", List("primitive")), ("weights", Kept)]),
    (
        "primitive",
        &[
            ("attributes", Object("attributes")),
            ("indices", Kept),
            ("material", Index("materials")),
            ("mode", Kept),
            ("targets", List("target")),
        ],
    ),
    (
        "attributes",
        &[
            ("COLOR_0", Kept),
            ("JOINTS_#", Kept),
            ("NORMAL", Kept),
            ("POSITION", Kept),
            ("TANGENT", TANGENTS),
            // Those that no texture asks for are told of where the mesh is read.
            ("TEXCOORD_#", Kept),
            ("WEIGHTS_#", Kept),
        ],
    ),
    ("target", &[("NORMAL", Kept), ("POSITION", Kept), ("TANGENT", TANGENTS)]),
    ("skin", &[("inverseBindMatrices", Kept), ("joints", Kept), ("skeleton", Silent)]),
    (
        "camera",
        &[("orthographic", Object("orthographic")), ("perspective", Object("perspective")), ("type", Kept)],
    ),
    ("perspective", &[("aspectRatio", Kept), ("yfov", Kept), ("zfar", Kept), ("znear", Kept)]),
    ("orthographic", &[("xmag", Kept), ("ymag", Kept), ("zfar", Kept), ("znear", Kept)]),
    (
        "accessor",
        &[
            ("bufferView", Kept),
            ("byteOffset", Kept),
            ("componentType", Kept),
            ("count", Kept),
            ("max", Silent),
            ("min", Silent),
            ("normalized", Kept),
            ("sparse", Object("sparse")),
            ("type", Kept),
        ],
    ),
    (
        "sparse",
        &[("count", Kept), ("indices", Object("sparse indices")), ("values", Object("sparse values"))],
    ),
    ("sparse indices", &[("bufferView", Kept), ("byteOffset", Kept), ("componentType", Kept)]),
    ("sparse values", &[("bufferView", Kept), ("byteOffset", Kept)]),
    (
        "bufferView",
        &[
            ("buffer", Kept),
            ("byteLength", Kept),
            ("byteOffset", Kept),
            ("byteStride", Kept),
            ("target", Silent),
        ],
    ),
    ("buffer", &[("byteLength", Kept), ("uri", Kept)]),
    ("image", &[("bufferView", Index("bufferViews")), ("mimeType", Silent), ("uri", Text)]),
    ("texture", &[("sampler", Index("samplers")), ("source", Index("images"))]),
    (
        "sampler",
        &[
            ("magFilter", Code(&[NEAREST, LINEAR])),
            // Pictures are not made smaller here.
            ("minFilter", Silent),
            ("wrapS", Code(&[CLAMP, MIRROR, REPEAT])),
            ("wrapT", Code(&[CLAMP, MIRROR, REPEAT])),
        ],
    ),
    ("textureInfo", &[("index", Index("textures")), ("texCoord", Whole)]),
    ("normalTexture", &[("index", Index("textures")), ("scale", Number), ("texCoord", Whole)]),
    (
        "material",
        &[
            ("alphaCutoff", Number),
            ("alphaMode", Word(&["OPAQUE", "MASK", "BLEND"])),
            ("doubleSided", Boolean),
            ("emissiveFactor", Numbers(3)),
            ("emissiveTexture", Object("textureInfo")),
            ("normalTexture", Object("normalTexture")),
            ("occlusionTexture", Told("light itself is occluded")),
            ("pbrMetallicRoughness", Object("pbrMetallicRoughness")),
        ],
    ),
    (
        "pbrMetallicRoughness",
        &[
            ("baseColorFactor", Shares(4)),
            ("baseColorTexture", Object("textureInfo")),
            ("metallicFactor", Share),
            ("metallicRoughnessTexture", Object("textureInfo")),
            ("roughnessFactor", Share),
        ],
    ),
    ("KHR_lights_punctual", &[("lights", List("light"))]),
    ("KHR_lights_punctual of a node", &[("light", Kept)]),
    (
        "light",
        &[
            ("color", Kept),
            ("intensity", Kept),
            ("range", Told("light falls off with the square of the distance and has no end")),
            ("spot", Object("spot")),
            ("type", Kept),
        ],
    ),
    ("spot", &[("innerConeAngle", Kept), ("outerConeAngle", Kept)]),
    ("EXT_mesh_gpu_instancing", &[("attributes", Object("instances"))]),
    (
        "instances",
        &[
            ("ROTATION", Index("accessors")),
            ("SCALE", Index("accessors")),
            ("TRANSLATION", Index("accessors")),
        ],
    ),
    ("compressed primitive", &[("attributes", Kept), ("bufferView", Index("bufferViews"))]),
    (
        "compressed view",
        &[
            ("buffer", Index("buffers")),
            ("byteLength", Whole),
            ("byteOffset", Whole),
            ("byteStride", Whole),
            ("count", Whole),
            ("filter", Word(meshopt::FILTERS)),
            ("mode", Word(meshopt::MODES)),
        ],
    ),
    ("fallback buffer", &[("fallback", Boolean)]),
    ("EXT_texture_webp", &[("source", Index("images"))]),
    ("KHR_texture_basisu", &[("source", Index("images"))]),
    (
        "KHR_texture_transform",
        &[("offset", Numbers(2)), ("rotation", Number), ("scale", Numbers(2)), ("texCoord", Whole)],
    ),
    ("KHR_materials_unlit", &[]),
    ("KHR_materials_emissive_strength", &[("emissiveStrength", Number)]),
    ("KHR_materials_dispersion", &[("dispersion", Number)]),
    ("KHR_materials_ior", &[("ior", Number)]),
    (
        "KHR_materials_iridescence",
        &[
            ("iridescenceFactor", Share),
            ("iridescenceIor", Number),
            ("iridescenceTexture", Object("textureInfo")),
            ("iridescenceThicknessMaximum", Number),
            ("iridescenceThicknessMinimum", Number),
            ("iridescenceThicknessTexture", Object("textureInfo")),
        ],
    ),
    (
        "KHR_materials_transmission",
        &[("transmissionFactor", Share), ("transmissionTexture", Object("textureInfo"))],
    ),
    (
        "KHR_materials_volume",
        &[
            ("attenuationColor", Shares(3)),
            ("attenuationDistance", Number),
            ("thicknessFactor", Number),
            // Rays find the other side of a solid themselves.
            ("thicknessTexture", Silent),
        ],
    ),
    (
        "KHR_materials_volume_scatter",
        &[
            ("multiscatterColor", Shares(3)),
            ("multiscatterColorFactor", Shares(3)),
            ("multiscatterColorTexture", Told("a volume has one colour")),
            ("scatterAnisotropy", Number),
        ],
    ),
    (
        "KHR_materials_clearcoat",
        &[
            ("clearcoatFactor", Share),
            ("clearcoatNormalTexture", Told("a clear coat has the normals of its base")),
            ("clearcoatRoughnessFactor", Share),
            ("clearcoatRoughnessTexture", Object("textureInfo")),
            ("clearcoatTexture", Object("textureInfo")),
        ],
    ),
    (
        "KHR_materials_sheen",
        &[
            ("sheenColorFactor", Shares(3)),
            ("sheenColorTexture", Object("textureInfo")),
            ("sheenRoughnessFactor", Told("the sheen of `principled` has no roughness")),
            ("sheenRoughnessTexture", Told("the sheen of `principled` has no roughness")),
        ],
    ),
    (
        "KHR_materials_specular",
        &[
            ("specularColorFactor", Numbers(3)),
            ("specularColorTexture", Told("one index of refraction makes the reflection everywhere")),
            ("specularFactor", Share),
            ("specularTexture", Told("one index of refraction makes the reflection everywhere")),
        ],
    ),
    (
        "KHR_materials_anisotropy",
        &[
            ("anisotropyRotation", Number),
            ("anisotropyStrength", Share),
            ("anisotropyTexture", Told("highlights are stretched along u everywhere")),
        ],
    ),
    (
        "KHR_materials_diffuse_transmission",
        &[
            ("diffuseTransmissionColorFactor", Shares(3)),
            ("diffuseTransmissionColorTexture", Object("textureInfo")),
            ("diffuseTransmissionFactor", Share),
            ("diffuseTransmissionTexture", Object("textureInfo")),
        ],
    ),
    (
        "KHR_materials_pbrSpecularGlossiness",
        &[
            ("diffuseFactor", Shares(4)),
            ("diffuseTexture", Object("textureInfo")),
            ("glossinessFactor", Share),
            ("specularFactor", Shares(3)),
            ("specularGlossinessTexture", Object("textureInfo")),
        ],
    ),
];

/// Kind of an object, extension, and what becomes of it.
pub(super) const EXTENSIONS: &[(&str, &str, Rule)] = &[
    ("file", "KHR_lights_punctual", Object("KHR_lights_punctual")),
    ("file", "KHR_materials_variants", Told("the first look of each material is shown")),
    ("node", "KHR_lights_punctual", Object("KHR_lights_punctual of a node")),
    ("node", "EXT_mesh_gpu_instancing", Object("EXT_mesh_gpu_instancing")),
    ("primitive", "KHR_draco_mesh_compression", Object("compressed primitive")),
    // How triangles are parts of polygons, which look the same.
    ("primitive", "FB_ngon_encoding", Silent),
    ("primitive", "KHR_materials_variants", Told("the first look of each material is shown")),
    ("bufferView", "EXT_meshopt_compression", Object("compressed view")),
    ("bufferView", "KHR_meshopt_compression", Object("compressed view")),
    ("buffer", "EXT_meshopt_compression", Object("fallback buffer")),
    ("buffer", "KHR_meshopt_compression", Object("fallback buffer")),
    ("texture", "EXT_texture_webp", Object("EXT_texture_webp")),
    ("texture", "KHR_texture_basisu", Object("KHR_texture_basisu")),
    ("texture", "EXT_texture_avif", FALLBACK),
    ("texture", "MSFT_texture_dds", FALLBACK),
    ("textureInfo", "KHR_texture_transform", TRANSFORMED),
    ("normalTexture", "KHR_texture_transform", TRANSFORMED),
    ("material", "KHR_materials_anisotropy", Object("KHR_materials_anisotropy")),
    ("material", "KHR_materials_clearcoat", Object("KHR_materials_clearcoat")),
    ("material", "KHR_materials_diffuse_transmission", Object("KHR_materials_diffuse_transmission")),
    ("material", "KHR_materials_dispersion", Object("KHR_materials_dispersion")),
    ("material", "KHR_materials_emissive_strength", Object("KHR_materials_emissive_strength")),
    ("material", "KHR_materials_ior", Object("KHR_materials_ior")),
    ("material", "KHR_materials_iridescence", Object("KHR_materials_iridescence")),
    ("material", "KHR_materials_pbrSpecularGlossiness", Object("KHR_materials_pbrSpecularGlossiness")),
    ("material", "KHR_materials_sheen", Object("KHR_materials_sheen")),
    ("material", "KHR_materials_specular", Object("KHR_materials_specular")),
    ("material", "KHR_materials_transmission", Object("KHR_materials_transmission")),
    ("material", "KHR_materials_unlit", Object("KHR_materials_unlit")),
    ("material", "KHR_materials_volume", Object("KHR_materials_volume")),
    ("material", "KHR_materials_volume_scatter", Object("KHR_materials_volume_scatter")),
];
