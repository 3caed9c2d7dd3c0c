//! `KHR_draco_mesh_compression`: the triangles and attributes of a primitive in one stream (Draco bitstream 1.x and 2.x).
//!
//! Each attribute that the extension names becomes the elements of its accessor, in the numbers that the accessor says, so that
//! all that reads accessors reads decompressed ones. Vertices come in the order of the stream.

use std::collections::BTreeMap;

use draco_core::{
    DataType, DecodeLimits, DecoderBuffer, ErrorKind, Mesh, MeshDecoder, PointAttribute, PointIndex,
};
use gltf::accessor::DataType as ElementType;
use serde_json::{Map, Value};

use super::json::{extension, index};
use crate::scene::diagnostic::shorten;
use crate::scene::limits;

/// The name of the extension.
pub(super) const NAME: &str = "KHR_draco_mesh_compression";

/// Bytes that the decoder may need for each triangle: its corners, their neighbours and the order of its vertices.
const PER_TRIANGLE: u64 = 100;

/// A compressed primitive.
pub(super) struct CompressedPrimitive<'r> {
    /// The index of the view that has its stream.
    pub(super) view: usize,
    /// The number of each attribute in the stream, by its name.
    attributes: Option<&'r Map<String, Value>>,
}

/// A decoded primitive.
pub(super) struct DecodedPrimitive {
    pub(super) triangles: Vec<[u32; 3]>,
    /// The elements of accessors, by their index.
    pub(super) elements: BTreeMap<usize, Vec<u8>>,
}

impl<'r> CompressedPrimitive<'r> {
    /// Of this entry of `primitives`; none if it is not compressed.
    pub(super) fn of(primitive: &'r Value) -> Option<Self> {
        let object = extension(primitive, NAME);
        Some(Self { view: index(object, "bufferView")?, attributes: object["attributes"].as_object() })
    }

    /// Decodes the stream `bytes` into at most about `most` bytes. `accessors`: those of the attributes of the primitive, by name.
    ///
    /// # Errors
    ///
    /// If the stream is invalid or lacks an attribute; the message says which.
    pub(super) fn decoded(
        &self,
        bytes: &[u8],
        accessors: &BTreeMap<String, gltf::Accessor<'_>>,
        most: u64,
    ) -> Result<DecodedPrimitive, String> {
        let allowed = DecodeLimits::default()
            .with_max_points((limits::MESH_VERTICES as u64).min(most / 12))
            .with_max_faces((limits::MESH_TRIANGLES as u64).min(most / PER_TRIANGLE))
            .with_max_decoded_bytes(most);
        let mut mesh = Mesh::new();
        let mut buffer = DecoderBuffer::new(bytes).with_limits(allowed);
        let read = MeshDecoder::new().decode(&mut buffer, &mut mesh);
        read.map_err(|e| match e.kind() {
            ErrorKind::LimitExceeded | ErrorKind::AllocationExceedsInput => {
                "its mesh is far larger than its stream".to_owned()
            }
            _ => format!("its stream holds no mesh that can be decoded ({})", e.message()),
        })?;
        let triangles = mesh.faces().iter().map(|face| face.map(|corner| corner.0)).collect();
        let mut elements = BTreeMap::new();
        let mut left = most;
        for (name, id) in self.attributes.into_iter().flatten() {
            // An attribute that the primitive does not have is of no use.
            let Some(accessor) = accessors.get(name) else { continue };
            let id = id.as_u64().and_then(|id| u32::try_from(id).ok());
            let attribute = id.and_then(|id| mesh.attribute_by_unique_id(id));
            let name = shorten(name);
            let attribute = attribute.ok_or_else(|| format!("its stream has no attribute for `{name}`"))?;
            let size = (mesh.num_points() * accessor.size()) as u64;
            left = left.checked_sub(size).ok_or("its attributes are far larger than its stream")?;
            let values = converted(attribute, mesh.num_points(), accessor)
                .ok_or_else(|| format!("the attribute of its stream for `{name}` has too few numbers"))?;
            elements.insert(accessor.index(), values);
        }
        Ok(DecodedPrimitive { triangles, elements })
    }
}

/// The values of an attribute for `count` vertices as the elements of an accessor; none if it lacks numbers.
fn converted(attribute: &PointAttribute, count: usize, accessor: &gltf::Accessor<'_>) -> Option<Vec<u8>> {
    let numbers = accessor.dimensions().multiplicity();
    let (kind, data) = (attribute.data_type(), attribute.buffer().data());
    let stride = usize::try_from(attribute.byte_stride()).ok()?;
    let width = kind.byte_length();
    if width == 0 || numbers * width > stride {
        return None;
    }
    let largest = if attribute.normalized() { largest(kind) } else { None };
    let mut out = Vec::with_capacity(count * accessor.size());
    for point in 0..count as u32 {
        let at = (attribute.mapped_index(PointIndex(point)).0 as usize).checked_mul(stride)?;
        let value = data.get(at..at.checked_add(numbers * width)?)?;
        for number in value.chunks_exact(width) {
            let number = value_of(kind, number);
            push(&mut out, accessor, number, largest.filter(|_| kind.is_integral()));
        }
    }
    Some(out)
}

/// The largest integer of a kind: that of a normalised one.
fn largest(kind: DataType) -> Option<f64> {
    Some(match kind {
        DataType::Int8 => 127.0,
        DataType::Uint8 => 255.0,
        DataType::Int16 => 32_767.0,
        DataType::Uint16 => 65_535.0,
        DataType::Int32 => f64::from(i32::MAX),
        DataType::Uint32 => f64::from(u32::MAX),
        _ => return None,
    })
}

/// A number of the stream. Integers of 64 bits, which glTF has not, lose their lowest bits.
fn value_of(kind: DataType, bytes: &[u8]) -> f64 {
    match (kind, bytes) {
        (DataType::Int8, &[a]) => (a as i8).into(),
        (DataType::Uint8 | DataType::Bool, &[a]) => a.into(),
        (DataType::Int16, &[a, b]) => i16::from_le_bytes([a, b]).into(),
        (DataType::Uint16, &[a, b]) => u16::from_le_bytes([a, b]).into(),
        (DataType::Int32, &[a, b, c, d]) => i32::from_le_bytes([a, b, c, d]).into(),
        (DataType::Uint32, &[a, b, c, d]) => u32::from_le_bytes([a, b, c, d]).into(),
        (DataType::Float32, &[a, b, c, d]) => f32::from_le_bytes([a, b, c, d]).into(),
        (DataType::Int64, bytes) => bytes.try_into().map_or(f64::NAN, |b| i64::from_le_bytes(b) as f64),
        (DataType::Uint64, bytes) => bytes.try_into().map_or(f64::NAN, |b| u64::from_le_bytes(b) as f64),
        (_, bytes) => bytes.try_into().map_or(f64::NAN, f64::from_le_bytes),
    }
}

/// Appends a number as one of an accessor. `largest`: it is an integer that means a share of this.
fn push(out: &mut Vec<u8>, accessor: &gltf::Accessor<'_>, number: f64, largest: Option<f64>) {
    let share = largest.map(|largest| (number / largest).max(-1.0));
    // Whole numbers stay as they are, also those that mean shares of the same kind.
    let whole = |most: f64| match share {
        Some(share) if accessor.normalized() => (share * most).round(),
        _ => number.round(),
    };
    match accessor.data_type() {
        ElementType::F32 => out.extend((share.unwrap_or(number) as f32).to_le_bytes()),
        ElementType::I8 => out.extend((whole(127.0) as i8).to_le_bytes()),
        ElementType::U8 => out.push(whole(255.0) as u8),
        ElementType::I16 => out.extend((whole(32_767.0) as i16).to_le_bytes()),
        ElementType::U16 => out.extend((whole(65_535.0) as u16).to_le_bytes()),
        ElementType::U32 => out.extend((whole(f64::from(u32::MAX)) as u32).to_le_bytes()),
    }
}
