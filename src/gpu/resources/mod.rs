//! What commands use: buffers, images, shaders and pipelines. Dropping one retires it until no frame can use it.

pub(in crate::gpu) mod buffer;
pub(in crate::gpu) mod compute;
pub(in crate::gpu) mod image;
pub(in crate::gpu) mod pipeline;
pub(in crate::gpu) mod shader;
