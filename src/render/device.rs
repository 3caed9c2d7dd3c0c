//! The rasteriser of a run: a Vulkan device, or the CPU references.

use miette::{IntoDiagnostic, Result};

use crate::client::cascades::CascadeFilm;
use crate::client::film::VulkanFilm;
use crate::client::reference::ReferenceFilm;
use crate::client::{ClientError, Film, FilmSpec};
use crate::gpu::{DeviceChoice, DeviceKind, Gpu, GpuError};
use crate::render::pipelines;
use crate::server::Priority;

/// Name of the CPU references.
pub const CPU: &str = "cpu";

/// An opened device.
pub enum Device {
    Vulkan(std::sync::Arc<Gpu>),
    /// The CPU references.
    Cpu,
}

impl Device {
    /// Opens the requested device; by default the best Vulkan device, or the CPU if there is none.
    ///
    /// # Errors
    ///
    /// When a requested device does not exist or lacks a feature; the message says which.
    pub fn open(choice: Option<&str>) -> Result<Self> {
        match choice {
            Some(CPU) => Ok(Device::Cpu),
            Some(text) => Self::vulkan(&DeviceChoice::parse(text)).into_diagnostic(),
            None => Ok(Self::vulkan(&DeviceChoice::Best).unwrap_or_else(|error| {
                tracing::warn!("no Vulkan device, rendering with --device cpu: {error}");
                Device::Cpu
            })),
        }
    }

    /// The selected Vulkan device, with pipelines cached by earlier runs.
    fn vulkan(choice: &DeviceChoice) -> Result<Self, GpuError> {
        let gpu = Gpu::new(choice)?;
        pipelines::keep(&gpu);
        Ok(Device::Vulkan(gpu))
    }

    /// The device's name.
    pub fn name(&self) -> String {
        match self {
            Device::Vulkan(gpu) => gpu.info().name.clone(),
            Device::Cpu => CPU.to_string(),
        }
    }

    /// The Vulkan device, if it is one.
    pub fn gpu(&self) -> Option<&std::sync::Arc<Gpu>> {
        match self {
            Device::Vulkan(gpu) => Some(gpu),
            Device::Cpu => None,
        }
    }

    /// Priority of tracing threads. If the driver rasterises on the CPU it has precedence, so that the stream's lanes never fill up.
    pub fn tracing_priority(&self) -> Priority {
        match self.gpu() {
            Some(gpu) if gpu.info().kind == DeviceKind::Cpu => Priority::Background,
            _ => Priority::Normal,
        }
    }

    /// Creates a film on this device. `kappa`: threshold of firefly reweighting, if any. `threads`: for the CPU references.
    pub fn client(&self, spec: FilmSpec, threads: usize, kappa: Option<f32>) -> Result<Box<dyn Film>> {
        let gpu = self.gpu().cloned();
        let make = move |spec| -> Result<Box<dyn Film>, ClientError> {
            Ok(match &gpu {
                Some(gpu) => Box::new(VulkanFilm::new(gpu.clone(), spec)?),
                None => Box::new(ReferenceFilm::new(spec, threads)?),
            })
        };
        match kappa {
            Some(kappa) => Ok(Box::new(CascadeFilm::new(Box::new(make), spec, kappa).into_diagnostic()?)),
            None => make(spec).into_diagnostic(),
        }
    }
}
