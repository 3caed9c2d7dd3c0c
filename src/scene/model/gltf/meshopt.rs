//! `EXT_meshopt_compression` and `KHR_meshopt_compression`: views of buffers in the codecs of meshoptimizer.
//!
//! Both have the same properties; the newer one adds the filter `COLOR` and version 1 of the codec of vertices. Each file may use
//! both versions here, as decoders elsewhere allow.

use meshoptimizer_rs::{Limits, Workspace, codec};
use serde_json::Value;

use super::json::{extension, index};

/// The names of the extension; of two the first counts.
pub(super) const NAMES: [&str; 2] = ["KHR_meshopt_compression", "EXT_meshopt_compression"];

/// Words for `mode`.
pub(super) const MODES: &[&str] = &["ATTRIBUTES", "TRIANGLES", "INDICES"];

/// Words for `filter`.
pub(super) const FILTERS: &[&str] = &["NONE", "OCTAHEDRAL", "QUATERNION", "EXPONENTIAL", "COLOR"];

/// A compressed view.
pub(super) struct CompressedView<'r> {
    /// The name of the extension.
    pub(super) extension: &'static str,
    pub(super) buffer: usize,
    pub(super) offset: usize,
    pub(super) length: usize,
    stride: usize,
    count: usize,
    mode: &'r str,
    filter: &'r str,
}

impl<'r> CompressedView<'r> {
    /// Of this entry of `bufferViews`; none if it is not compressed.
    pub(super) fn of(view: &'r Value) -> Option<Self> {
        let name = NAMES.into_iter().find(|name| !extension(view, name).is_null())?;
        let object = extension(view, name);
        let number = |name| index(object, name).unwrap_or(0);
        Some(Self {
            extension: name,
            buffer: number("buffer"),
            offset: number("byteOffset"),
            length: number("byteLength"),
            stride: number("byteStride"),
            count: number("count"),
            mode: object["mode"].as_str().unwrap_or_default(),
            filter: object["filter"].as_str().unwrap_or("NONE"),
        })
    }

    /// Bytes of the view when it is decompressed.
    pub(super) fn size(&self) -> Option<usize> {
        self.count.checked_mul(self.stride)
    }

    /// Decompresses `source`. The caller has bounded [`size`](Self::size).
    ///
    /// # Errors
    ///
    /// If the view or its bytes are invalid; the message says why.
    pub(super) fn decoded(&self, source: &[u8]) -> Result<Vec<u8>, String> {
        if self.mode != "ATTRIBUTES" && self.filter != "NONE" {
            return Err(format!("indices have no filter `{}`", self.filter));
        }
        let (count, stride) = (self.count, self.stride);
        let bytes = self.size().unwrap_or(usize::MAX);
        let mut workspace = Workspace::new(Limits { max_bytes: bytes, ..Limits::default() });
        let decode = match self.mode {
            "ATTRIBUTES" => codec::decode_vertex_buffer,
            "TRIANGLES" => codec::decode_index_buffer,
            _ => codec::decode_index_sequence,
        };
        let wrong = |e: meshoptimizer_rs::Error| format!("its compressed data are damaged: {e}");
        let mut out = decode(count, stride, source, &mut workspace).map_err(wrong)?;
        let filter = match self.filter {
            "OCTAHEDRAL" => codec::decode_filter_oct,
            "QUATERNION" => codec::decode_filter_quat,
            "EXPONENTIAL" => codec::decode_filter_exp,
            "COLOR" => codec::decode_filter_color,
            _ => return Ok(out),
        };
        filter(&mut out, count, stride, &mut workspace).map_err(wrong)?;
        Ok(out)
    }
}

/// Whether a buffer stands in for compressed data and may have none itself.
pub(super) fn is_fallback(buffer: &Value) -> bool {
    NAMES.iter().any(|name| extension(buffer, name)["fallback"].as_bool() == Some(true))
}
