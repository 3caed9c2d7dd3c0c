//! Bytes of a glTF file, wherever they are, and the numbers of its accessors. Every range is checked here; the readers of the crate
//! panic on some.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use gltf::accessor::DataType;
use serde_json::Value;

use super::draco::{self, CompressedPrimitive, DecodedPrimitive};
use super::meshopt::{self, CompressedView};
use super::parse::ModelDocument;
use super::{grammar, json};
use crate::scene::diagnostic::shorten;
use crate::scene::files::SceneFiles;
use crate::scene::limits;

/// The buffers of a file, read when they are asked for.
pub(super) struct Buffers<'a> {
    folder: PathBuf,
    document: &'a gltf::Document,
    root: &'a Value,
    blob: Option<&'a [u8]>,
    files: &'a SceneFiles,
    read: BTreeMap<usize, Cow<'a, [u8]>>,
    /// Views that were decompressed; none where the data that stand in for them are used.
    decompressed: BTreeMap<usize, Option<Vec<u8>>>,
    /// Elements of accessors that are compressed in the primitive that is being read.
    elements: BTreeMap<usize, Vec<u8>>,
    /// Views whose compressed primitives cannot be decoded, with the reason.
    damaged: BTreeMap<usize, String>,
    /// Notes about what was not used, each with its place.
    pub(super) remarks: Vec<(String, String)>,
    /// Bytes of numbers that may still be made of the file: meshes may share accessors without end.
    left: u64,
}

/// The bytes of an image, or its file on the disk.
pub(super) enum ImageSource {
    /// PNG, JPEG, WebP or KTX2.
    Bytes(Vec<u8>),
    /// A name relative to the model.
    File(String),
}

impl<'a> Buffers<'a> {
    /// The buffers of a model, which was read from a file of `size` bytes.
    pub(super) fn new(path: &Path, model: &'a ModelDocument, size: usize, files: &'a SceneFiles) -> Self {
        let folder = path.parent().unwrap_or(Path::new("")).to_owned();
        let left = limits::MESH_INFLATED_FREE + limits::MESH_INFLATION * size as u64;
        let ModelDocument { root, document, blob } = model;
        Self {
            folder,
            document,
            root,
            blob: blob.as_deref(),
            files,
            read: BTreeMap::new(),
            decompressed: BTreeMap::new(),
            elements: BTreeMap::new(),
            damaged: BTreeMap::new(),
            remarks: Vec::new(),
            left,
        }
    }

    /// Takes part of the memory that a file of this size may need.
    pub(super) fn spend(&mut self, bytes: usize) -> Result<(), String> {
        let left = self.left.checked_sub(bytes as u64);
        self.left =
            left.ok_or("its meshes are far larger than its files: it names the same data too often")?;
        Ok(())
    }

    /// The bytes of a buffer. Files of their own add to what may be made of the model.
    fn buffer(&mut self, buffer: &gltf::Buffer<'a>) -> Result<&[u8], String> {
        let index = buffer.index();
        if !self.read.contains_key(&index) {
            let bytes = match buffer.source() {
                gltf::buffer::Source::Bin => {
                    let blob = self.blob.filter(|_| index == 0);
                    Cow::Borrowed(
                        blob.ok_or_else(|| without_data(&self.root["buffers"][index], "buffers", index))?,
                    )
                }
                gltf::buffer::Source::Uri(uri) => match data_uri(uri)? {
                    Some(bytes) => Cow::Owned(bytes),
                    None => {
                        let path = self.folder.join(decoded(uri));
                        self.files.read(&path, limits::MESH_BYTES).map_err(|e| e.to_string())?
                    }
                },
            };
            self.left += limits::MESH_INFLATION * bytes.len() as u64;
            self.read.insert(index, bytes);
        }
        Ok(&self.read[&index])
    }

    /// The bytes of a view, decompressed.
    fn view(&mut self, view: &gltf::buffer::View<'a>) -> Result<&[u8], String> {
        let index = view.index();
        if !self.decompressed.contains_key(&index) {
            let bytes = self.decompress(index)?;
            self.decompressed.insert(index, bytes);
        }
        match self.decompressed.get(&index) {
            // Asked for anew: the borrow checker does not see that the other case has let go of it.
            Some(Some(_)) => Ok(self.decompressed[&index].as_deref().unwrap_or_default()),
            _ => self.range(index, &view.buffer(), view.offset(), view.length()),
        }
    }

    /// So many bytes of a buffer, for this view.
    fn range(
        &mut self,
        view: usize,
        buffer: &gltf::Buffer<'a>,
        offset: usize,
        length: usize,
    ) -> Result<&[u8], String> {
        let bytes = self.buffer(buffer)?;
        let end = offset.checked_add(length);
        end.and_then(|end| bytes.get(offset..end))
            .ok_or_else(|| format!("bufferViews[{view}] reaches beyond its buffer of {} bytes", bytes.len()))
    }

    /// The bytes of a compressed view; none for another one, and where only the data that stand in for it can be used.
    fn decompress(&mut self, view: usize) -> Result<Option<Vec<u8>>, String> {
        let root = self.root;
        let Some(compressed) = CompressedView::of(&root["bufferViews"][view]) else { return Ok(None) };
        match self.decompressed_view(view, &compressed) {
            Ok(bytes) => Ok(Some(bytes)),
            Err(message) => {
                let (name, place) = (compressed.extension, format!("bufferViews[{view}]"));
                let buffer = json::index(&root["bufferViews"][view], "buffer").unwrap_or(0);
                let object = &root["buffers"][buffer];
                let is_binary = buffer == 0 && self.blob.is_some() && !meshopt::is_fallback(object);
                if object["uri"].is_string() || is_binary {
                    let message = format!("data that stand in for `{name}` are used, since {message}");
                    self.remarks.push((message, place));
                    return Ok(None);
                }
                Err(format!(
                    "{place} cannot be read (`{name}`): {message}; export the model again, or without the extension"
                ))
            }
        }
    }

    fn decompressed_view(&mut self, view: usize, compressed: &CompressedView<'_>) -> Result<Vec<u8>, String> {
        let size = compressed.size().filter(|size| *size <= limits::MESH_BYTES as usize);
        self.spend(size.ok_or("it has more elements than any mesh")?)?;
        let buffer = self.document.buffers().nth(compressed.buffer).ok_or("its buffer is not there")?;
        let source = self.range(view, &buffer, compressed.offset, compressed.length)?;
        compressed.decoded(source)
    }

    /// Decodes a primitive that is compressed as a whole: its triangles. From now on its accessors have the elements that were
    /// decoded. None for another primitive, and where only the data that stand in for it can be used.
    pub(super) fn decompress_primitive(
        &mut self,
        primitive: &gltf::Primitive<'a>,
        object: &'a Value,
        place: &str,
    ) -> Result<Option<Vec<[u32; 3]>>, String> {
        self.elements.clear();
        let Some(compressed) = CompressedPrimitive::of(object) else { return Ok(None) };
        let decoded = match self.damaged.get(&compressed.view) {
            Some(message) => Err(message.clone()),
            None => self.decoded_primitive(&compressed, object),
        };
        let name = draco::NAME;
        match decoded {
            Ok(DecodedPrimitive { triangles, elements }) => {
                self.elements = elements;
                Ok(Some(triangles))
            }
            Err(message) => {
                self.damaged.insert(compressed.view, message.clone());
                let has_data = |accessor: gltf::Accessor<'_>| accessor.view().is_some();
                if primitive.attributes().all(|(_, accessor)| has_data(accessor))
                    && primitive.indices().is_none_or(has_data)
                {
                    let message = format!("data that stand in for `{name}` are used, since {message}");
                    self.remarks.push((message, place.to_owned()));
                    return Ok(None);
                }
                Err(format!(
                    "{place} cannot be read (`{name}`): {message}; export the model again, or without the extension"
                ))
            }
        }
    }

    fn decoded_primitive(
        &mut self,
        compressed: &CompressedPrimitive<'_>,
        object: &Value,
    ) -> Result<DecodedPrimitive, String> {
        let named = object["attributes"].as_object().into_iter().flatten();
        let accessors = named
            .filter(|(name, _)| grammar::is_attribute(name))
            .filter_map(|(name, index)| {
                let index = usize::try_from(index.as_u64()?).ok()?;
                Some((name.clone(), self.accessor(index).ok()?))
            })
            .collect();
        let view = self.document.views().nth(compressed.view).ok_or("its view is not there")?;
        // Primitives may share a stream, which is decoded for each.
        self.spend(view.length())?;
        let most = self.left;
        let decoded = compressed.decoded(self.view(&view)?, &accessors, most)?;
        let elements: usize = decoded.elements.values().map(Vec::len).sum();
        self.spend(elements + 12 * decoded.triangles.len())?;
        Ok(decoded)
    }

    /// The elements of an accessor without what is between them.
    fn elements(&mut self, accessor: &gltf::Accessor<'a>) -> Result<Vec<u8>, String> {
        let (size, count, index) = (accessor.size(), accessor.count(), accessor.index());
        if let Some(elements) = self.elements.get(&index) {
            return Ok(elements.clone());
        }
        let bytes = size.checked_mul(count).filter(|_| count <= limits::MESH_VERTICES);
        let bytes = bytes.ok_or_else(|| format!("accessors[{index}] has more elements than any mesh"))?;
        self.spend(bytes)?;
        let mut out = match accessor.view() {
            Some(view) => self.strided(&view, accessor.offset(), size, count, index)?,
            None => vec![0; bytes],
        };
        if let Some(sparse) = accessor.sparse().filter(|sparse| sparse.count() > 0) {
            let (places, values, count) = (sparse.indices(), sparse.values(), sparse.count());
            if count > accessor.count() {
                return Err(format!("accessors[{index}] has more sparse elements than elements"));
            }
            let width = places.index_type().size();
            let at = self.strided(&places.view(), places.offset(), width, count, index)?;
            let new = self.strided(&values.view(), values.offset(), size, count, index)?;
            for (at, new) in at.chunks_exact(width).zip(new.chunks_exact(size)) {
                let at = at.iter().rev().fold(0, |sum, byte| 256 * sum + usize::from(*byte));
                let old = out.get_mut(at * size..(at + 1) * size);
                old.ok_or_else(|| format!("accessors[{index}] has a sparse element beyond its end"))?
                    .copy_from_slice(new);
            }
        }
        Ok(out)
    }

    /// `count` elements of `size` bytes from `offset` on in a view.
    fn strided(
        &mut self,
        view: &gltf::buffer::View<'a>,
        offset: usize,
        size: usize,
        count: usize,
        accessor: usize,
    ) -> Result<Vec<u8>, String> {
        let stride = view.stride().unwrap_or(size).max(size);
        let bytes = self.view(view)?;
        let end = count
            .saturating_sub(1)
            .checked_mul(stride)
            .and_then(|n| n.checked_add(size)?.checked_add(offset));
        let beyond =
            || format!("accessors[{accessor}] reaches beyond its bufferView of {} bytes", bytes.len());
        let all = end.and_then(|end| bytes.get(offset..end)).ok_or_else(beyond)?;
        Ok(all.chunks(stride).take(count).flat_map(|element| &element[..size]).copied().collect())
    }

    /// The first `N` numbers of each element; integers are shares of their largest if the file says so.
    pub(super) fn floats<const N: usize>(
        &mut self,
        accessor: &gltf::Accessor<'a>,
    ) -> Result<Vec<[f32; N]>, String> {
        self.numbers(accessor, accessor.normalized())
    }

    /// As [`floats`](Self::floats), but integers are always shares of their largest: of a colour or a weight nothing else has a meaning.
    pub(super) fn shares<const N: usize>(
        &mut self,
        accessor: &gltf::Accessor<'a>,
    ) -> Result<Vec<[f32; N]>, String> {
        self.numbers(accessor, true)
    }

    /// As [`floats`](Self::floats), but integers are what they are.
    pub(super) fn integers<const N: usize>(
        &mut self,
        accessor: &gltf::Accessor<'a>,
    ) -> Result<Vec<[f32; N]>, String> {
        self.numbers(accessor, false)
    }

    fn numbers<const N: usize>(
        &mut self,
        accessor: &gltf::Accessor<'a>,
        normalized: bool,
    ) -> Result<Vec<[f32; N]>, String> {
        let (kind, index) = (accessor.data_type(), accessor.index());
        if accessor.dimensions().multiplicity() < N {
            return Err(format!("accessors[{index}] has not {N} numbers in each element"));
        }
        let width = kind.size();
        let part = |v: f32, most: f32| if normalized { (v / most).max(-1.0) } else { v };
        let value = |b: &[u8]| match (kind, b) {
            (DataType::F32, &[a, b, c, d]) => f32::from_le_bytes([a, b, c, d]),
            (DataType::U8, &[a]) => part(a.into(), 255.0),
            (DataType::I8, &[a]) => part((a as i8).into(), 127.0),
            (DataType::U16, &[a, b]) => part(u16::from_le_bytes([a, b]).into(), 65_535.0),
            (DataType::I16, &[a, b]) => part(i16::from_le_bytes([a, b]).into(), 32_767.0),
            _ => f32::NAN, // whole numbers of 32 bits are indices
        };
        let size = accessor.size();
        let elements = self.elements(accessor)?;
        let element = |e: &[u8]| std::array::from_fn(|i| value(&e[i * width..(i + 1) * width]));
        Ok(elements.chunks_exact(size).map(element).collect())
    }

    /// The numbers of an accessor of indices.
    pub(super) fn indices(&mut self, accessor: &gltf::Accessor<'a>) -> Result<Vec<u32>, String> {
        let (size, index) = (accessor.size(), accessor.index());
        if !matches!(
            (accessor.data_type(), size),
            (DataType::U8, 1) | (DataType::U16, 2) | (DataType::U32, 4)
        ) {
            return Err(format!("accessors[{index}] does not hold indices"));
        }
        let elements = self.elements(accessor)?;
        let number = |e: &[u8]| e.iter().rev().fold(0, |sum, byte| (sum << 8) | u32::from(*byte));
        Ok(elements.chunks_exact(size).map(number).collect())
    }

    /// The accessor of this index.
    pub(super) fn accessor(&self, index: usize) -> Result<gltf::Accessor<'a>, String> {
        self.document.accessors().nth(index).ok_or_else(|| format!("accessors[{index}] is not there"))
    }

    /// Where an image is.
    pub(super) fn image(&mut self, index: usize) -> Result<ImageSource, String> {
        let image = &self.root["images"][index];
        match (image["uri"].as_str(), json::index(image, "bufferView")) {
            (Some(uri), _) => Ok(match data_uri(uri)? {
                Some(bytes) => ImageSource::Bytes(bytes),
                None => ImageSource::File(decoded(uri)),
            }),
            (None, Some(view)) => {
                let view = self.document.views().nth(view).ok_or("it names a view that is not there")?;
                let bytes = self.view(&view)?.to_vec();
                Ok(ImageSource::Bytes(bytes))
            }
            (None, None) => Err(format!("images[{index}] has neither `uri` nor `bufferView`")),
        }
    }

    /// The bytes of an image.
    pub(super) fn image_bytes(&mut self, index: usize) -> Result<Vec<u8>, String> {
        match self.image(index)? {
            ImageSource::Bytes(bytes) => Ok(bytes),
            ImageSource::File(name) => {
                let read = self.files.read(&self.folder.join(name), limits::IMAGE_BYTES);
                Ok(read.map_err(|e| e.to_string())?.into_owned())
            }
        }
    }
}

/// The error of an object that has its data in an extension alone, or nowhere.
pub(super) fn without_data(object: &Value, list: &str, index: usize) -> String {
    match object["extensions"].as_object().and_then(|all| all.keys().next()) {
        Some(name) if meshopt::is_fallback(object) => format!(
            "{list}[{index}] has no data, since it stands in for views that are compressed by `{}`: another view must not use it",
            shorten(name)
        ),
        Some(name) => format!(
            "{list}[{index}] has data in the extension `{}` alone, which is not supported: export the model without it",
            shorten(name)
        ),
        None => format!("{list}[{index}] is to be in a binary part, which the file has not"),
    }
}

/// The bytes of a data URI (RFC 2397), or nothing for another one.
fn data_uri(uri: &str) -> Result<Option<Vec<u8>>, String> {
    let Some(data) = uri.strip_prefix("data:") else { return Ok(None) };
    let (kind, text) = data.split_once(',').ok_or("a data URI has no comma")?;
    if !kind.ends_with(";base64") {
        return Err("a data URI is not in base64".to_owned());
    }
    STANDARD.decode(text.trim_end()).map(Some).map_err(|e| format!("a data URI is not in base64: {e}"))
}

/// A relative URI as a file name: `%20` is a blank.
fn decoded(uri: &str) -> String {
    let hex = |pair: &[u8]| u8::from_str_radix(std::str::from_utf8(pair).ok()?, 16).ok();
    let (bytes, mut out, mut i) = (uri.as_bytes(), Vec::with_capacity(uri.len()), 0);
    while i < bytes.len() {
        let escaped = (bytes[i] == b'%').then(|| bytes.get(i + 1..i + 3).and_then(hex)).flatten();
        out.push(escaped.unwrap_or(bytes[i]));
        i += if escaped.is_some() { 3 } else { 1 };
    }
    String::from_utf8_lossy(&out).into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uris_are_data_or_files() {
        assert_eq!(decoded("a%20b%2fc%zz%4"), "a b/c%zz%4");
        assert_eq!(data_uri("data:image/png;base64,AQID"), Ok(Some(vec![1, 2, 3])));
        assert_eq!(data_uri("a.bin"), Ok(None));
        assert!(data_uri("data:,hello").is_err() && data_uri("data:;base64,?").is_err());
    }
}
