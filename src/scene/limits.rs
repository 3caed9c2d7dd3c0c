//! Limits on the size of inputs. A file beyond a limit is refused with a message that names the limit.

/// Bytes of one XML file.
pub const XML_BYTES: u64 = 64 << 20;

/// Bytes of all XML files of a scene together, counting a file each time it is included, and of all
/// text made by `$name` substitution.
pub const TOTAL_XML_BYTES: u64 = 256 << 20;

/// Includes within includes.
pub const INCLUDE_DEPTH: usize = 32;

/// Includes of a whole scene.
pub const INCLUDES: usize = 4096;

/// Elements within elements, counted through includes.
pub const NESTING: usize = 64;

/// Elements of a whole scene.
pub const ELEMENTS: usize = 1 << 20;

/// Attributes of one element.
pub const ATTRIBUTES: usize = 32;

/// Bytes of one attribute after `$name` substitution.
pub const SUBSTITUTED_BYTES: usize = 1 << 20;

/// References followed from one material to the next.
pub const REFERENCE_DEPTH: usize = 16;

/// Folders named by `path`.
pub const SEARCH_PATHS: usize = 16;

/// Bytes of one spectrum file.
pub const SPECTRUM_BYTES: u64 = 1 << 20;

/// Bytes of all spectrum files of a scene together.
pub const TOTAL_SPECTRUM_BYTES: usize = 64 << 20;

/// Bytes of one picture file.
pub const IMAGE_BYTES: u64 = 1 << 30;

/// Pixels of one picture (width times height).
pub const IMAGE_PIXELS: usize = 1 << 26;

/// Texels of all textures of a scene together, each file counted once.
pub const TOTAL_TEXELS: usize = 1 << 29;

/// Bytes of one file of a grid.
pub const GRID_BYTES: u64 = 1 << 30;

/// Bytes of one mesh file.
pub const MESH_BYTES: u64 = 1 << 30;

/// Objects in the JSON of a model, each of which takes up to 600 bytes; lists and values are eight times as many.
pub const JSON_OBJECTS: usize = 1 << 21;

/// Bytes of one line of a mesh file.
pub const MESH_LINE_BYTES: usize = 1 << 20;

/// Control points of one file of curves.
pub const CURVE_POINTS: usize = 1 << 22;

/// Faces of one mesh file, after polygons are cut into triangles.
pub const MESH_TRIANGLES: usize = 1 << 25;

/// Vertices of one mesh file.
pub const MESH_VERTICES: usize = 1 << 26;

/// A compressed mesh is at most this many times as large as its file, beyond the first [`MESH_INFLATED_FREE`] bytes: more than
/// vertices and indices can be compressed, and less than a file that was made to fill the memory.
pub const MESH_INFLATION: u64 = 100;

/// Bytes that a compressed mesh may have however small its file is.
pub const MESH_INFLATED_FREE: u64 = 16 << 20;

/// Triangles of all meshes of a scene together, each file counted once for each way it is read.
pub const SCENE_TRIANGLES: usize = 1 << 26;

/// Bytes of all mesh files of a scene together, counted in the same way.
pub const TOTAL_MESH_BYTES: u64 = 4 << 30;

/// Width or height of the film in pixels.
pub const FILM_SIDE: i64 = 1 << 16;

/// Pixels of the film (width times height).
pub const FILM_PIXELS: i64 = 1 << 28;

/// Layers beside the picture.
pub const AOVS: usize = 32;

/// Bytes of all layers beside a picture together.
pub const AOV_BYTES: u64 = 2 << 30;

/// Warnings kept; what comes after is only counted.
pub const WARNINGS: usize = 200;

/// Groups of lights of a render.
pub const LIGHT_GROUPS: usize = 8;
