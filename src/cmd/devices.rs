//! `pointillist devices`: what pictures can be rasterised on.

use std::io::{ErrorKind, Write};

use miette::{IntoDiagnostic, Result};

use crate::client::oidn;
use crate::gpu;
use crate::render::device::CPU;

/// One line per device, and what is missing where one cannot be used; and whether Open Image Denoise is there.
pub fn list() -> Result<()> {
    let mut text = String::new();
    match gpu::devices_with_memory() {
        Ok(found) => {
            for (device, memory) in &found {
                text += &format!(
                    "{}  {} ({}, Vulkan {}, {}; {memory}): {}\n",
                    device.index,
                    device.name,
                    device.kind,
                    device.api,
                    device.driver,
                    device.suitability()
                );
            }
        }
        Err(error) => text += &format!("(no Vulkan: {error})\n"),
    }
    text += &format!("{CPU}  the same passes in plain Rust, on all cores: always there\n");
    text += &match oidn::library() {
        Ok(library) => {
            format!(
                "oidn  Open Image Denoise {}, for --denoise oidn: {}\n",
                library.version(),
                library.path()
            )
        }
        Err(error) => format!("(no --denoise oidn: {error}; {})\n", oidn::HOW_TO_GET),
    };
    match std::io::stdout().write_all(text.as_bytes()) {
        // Whoever reads has read enough.
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(error).into_diagnostic(),
        _ => Ok(()),
    }
}
