//! Errors of the client, in sentences that say what to do.

/// An error of the client.
#[derive(Debug, thiserror::Error)]
pub enum ClientError {
    /// The film has no texels, or more than a device supports.
    #[error(
        "a film of {width}×{height} pixels is not possible: both sides must be 1 to {max}; choose another --size"
    )]
    Extent {
        /// Requested width, in pixels.
        width: u32,
        /// Requested height, in pixels.
        height: u32,
        /// Largest side for this filter, in pixels.
        max: u32,
    },

    /// The images of the film do not fit into memory.
    #[error("no memory for {what} ({bytes} bytes): choose a smaller --size or close other programs")]
    Memory {
        /// Name of the images.
        what: &'static str,
        /// Requested size in bytes.
        bytes: u64,
    },

    /// The threads of a film could not be started.
    #[error(
        "cannot start {threads} threads for a film: {reason}; ask for fewer with --threads or close other programs"
    )]
    Threads {
        /// Requested number of threads.
        threads: usize,
        /// The error of the system.
        reason: String,
    },

    /// The thread that sorts the samples of a film has panicked.
    #[error("the thread that sorts samples has panicked, and samples are lost: please report it")]
    SorterPanicked,

    /// The settings need the variance, which the film does not accumulate.
    #[error("the film keeps no variance, which noise masking and the error view need: make it with one")]
    NoVariance,

    /// The device cannot draw both eyes at once.
    #[error(
        "this device cannot draw to several layers of an image (it lacks shaderOutputLayer), which pictures of two eyes need: \
         update the graphics driver or choose another --device"
    )]
    Layers,

    /// The pictures of both eyes cannot be composed.
    #[error(transparent)]
    Stereo(#[from] crate::image::stereo::StereoError),

    /// Open Image Denoise is missing or failed.
    #[error(transparent)]
    Oidn(#[from] crate::client::oidn::OidnError),

    /// Vulkan failed.
    #[error(transparent)]
    Gpu(#[from] crate::gpu::GpuError),
}
