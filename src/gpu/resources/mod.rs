//! Buffers, images, shaders and pipelines, used by commands. Dropping one retires it until no frame can use it. [`sync`] defines the uses
//! of images and buffers and the barriers between them.

pub(in crate::gpu) mod buffer;
pub(in crate::gpu) mod image;
pub(in crate::gpu) mod pipeline;
pub(in crate::gpu) mod shader;
pub(in crate::gpu) mod sync;
