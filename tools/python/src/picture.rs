//! A picture in memory: its channels as arrays.

use std::path::PathBuf;

use numpy::ndarray::{Array2, Array3};
use numpy::{IntoPyArray, PyArray2, PyArray3, PyReadonlyArray2, PyReadonlyArray3};
use pointillist::cmd::library::{self, RenderedPicture};
use pointillist::image::exr::{self, Layers};
use pointillist::image::write::FileFormat;
use pointillist::image::{Attribute, ImageError};
use pyo3::exceptions::{PyKeyError, PyOSError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

use crate::errors::of_value;

/// Channels with their names, attributes, and the report of the render that made them.
#[pyclass(frozen, name = "Picture", module = "pointillist._native")]
pub struct NativePicture {
    layers: Layers,
    /// JSON; `null` for a picture on its way or from a file.
    report: String,
}

impl From<RenderedPicture> for NativePicture {
    fn from(rendered: RenderedPicture) -> Self {
        Self { layers: rendered.layers, report: rendered.report.to_string() }
    }
}

impl NativePicture {
    /// The picture of a scene that no command line has, as after changes, does not say by which command it is rendered again.
    pub fn without_command(mut self) -> Self {
        self.layers.attributes.retain(|(name, _)| name != "command");
        self
    }
}

impl From<Layers> for NativePicture {
    fn from(layers: Layers) -> Self {
        Self { layers, report: "null".to_owned() }
    }
}

#[pymethods]
impl NativePicture {
    /// A picture of arrays `[height][width][3]` and, if it is known, the variance of the mean luminance `[height][width]`.
    #[staticmethod]
    fn of_arrays(
        rgb: PyReadonlyArray3<'_, f32>,
        variance: Option<PyReadonlyArray2<'_, f32>>,
    ) -> PyResult<Self> {
        let rgb = rgb.as_array();
        let (height, width, 3) = rgb.dim() else {
            return Err(PyValueError::new_err("a picture has the shape (height, width, 3)"));
        };
        let mut layers = Layers { width, height, ..Layers::default() };
        for (c, name) in ["R", "G", "B"].into_iter().enumerate() {
            layers.push(name, rgb.index_axis(numpy::ndarray::Axis(2), c).iter().copied());
        }
        if let Some(variance) = variance {
            let variance = variance.as_array();
            if variance.dim() != (height, width) {
                return Err(PyValueError::new_err("a variance has the shape (height, width) of its picture"));
            }
            layers.push("variance.Y", variance.iter().copied());
        }
        Ok(Self::from(layers))
    }

    /// Width and height in pixels.
    #[getter]
    fn size(&self) -> (usize, usize) {
        (self.layers.width, self.layers.height)
    }

    /// Full names of all channels, in the order of a file.
    #[getter]
    fn channels(&self) -> Vec<&str> {
        self.layers.channels.iter().map(|(name, _)| name.as_str()).collect()
    }

    /// Attributes of a file of the picture.
    #[getter]
    fn attributes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let attributes = PyDict::new(py);
        for (name, value) in &self.layers.attributes {
            match value {
                Attribute::Text(text) => attributes.set_item(name, text)?,
                Attribute::Number(number) => attributes.set_item(name, number)?,
                Attribute::Bytes(bytes) => attributes.set_item(name, PyBytes::new(py, bytes))?,
            }
        }
        Ok(attributes)
    }

    /// Report of the render as JSON.
    #[getter]
    fn report(&self) -> &str {
        &self.report
    }

    /// One channel as a new array `[height][width]`.
    fn channel<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let (width, height) = self.size();
        let values = self.values(name)?.to_vec();
        Ok(Array2::from_shape_vec((height, width), values).map_err(cut)?.into_pyarray(py))
    }

    /// Several channels as a new array `[height][width][channel]`.
    fn interleaved<'py>(&self, py: Python<'py>, names: Vec<String>) -> PyResult<Bound<'py, PyArray3<f32>>> {
        let (width, height) = self.size();
        let channels = names.iter().map(|name| self.values(name)).collect::<PyResult<Vec<_>>>()?;
        let mut values = vec![0.0f32; width * height * channels.len()];
        for (c, channel) in channels.iter().enumerate() {
            values
                .iter_mut()
                .skip(c)
                .step_by(channels.len())
                .zip(*channel)
                .for_each(|(to, from)| *to = *from);
        }
        let shape = (height, width, channels.len());
        Ok(Array3::from_shape_vec(shape, values).map_err(cut)?.into_pyarray(py))
    }

    /// The bytes of a PNG file of the displayed picture.
    fn png<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let bytes = py.detach(|| library::png_bytes(&self.layers)).map_err(|error| of_value(&error))?;
        Ok(PyBytes::new(py, &bytes))
    }

    /// Writes an EXR file of all channels, or a PNG file of the displayed picture.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        FileFormat::of(&path).map_err(|error| PyValueError::new_err(error.to_string()))?;
        py.detach(|| library::save(&path, &self.layers))
            .map_err(|error| PyOSError::new_err(error.to_string()))
    }
}

impl NativePicture {
    fn values(&self, name: &str) -> PyResult<&[f32]> {
        self.layers.channel(name).ok_or_else(|| PyKeyError::new_err(name.to_owned()))
    }
}

fn cut(error: numpy::ndarray::ShapeError) -> PyErr {
    PyValueError::new_err(format!("a channel of the picture is cut short: {error}"))
}

/// Reads an EXR file.
#[pyfunction]
pub fn read(py: Python<'_>, path: PathBuf) -> PyResult<NativePicture> {
    match py.detach(|| exr::read(&path)) {
        Ok(layers) => Ok(layers.into()),
        Err(error @ ImageError::Read { .. }) => Err(PyOSError::new_err(error.to_string())),
        Err(error) => Err(PyValueError::new_err(error.to_string())),
    }
}

/// A metric as JSON, and its map.
type ComparedMetric<'py> = (String, Bound<'py, PyArray2<f32>>);

/// Metrics of a picture against a reference.
#[pyfunction]
pub fn compare<'py>(
    py: Python<'py>,
    picture: &NativePicture,
    reference: &NativePicture,
    metrics: Vec<String>,
    exposure: Option<f32>,
) -> PyResult<Vec<ComparedMetric<'py>>> {
    let both = [&picture.layers, &reference.layers];
    let compared = py.detach(|| library::compare_layers(both, &metrics, exposure));
    let compared = compared.map_err(|error| of_value(&error))?;
    let of = |compared: library::ComparedPictures| -> PyResult<ComparedMetric<'py>> {
        let shape = (compared.map.height(), compared.map.width());
        let map = Array2::from_shape_vec(shape, compared.map.into_pixels()).map_err(cut)?;
        Ok((compared.metric.to_string(), map.into_pyarray(py)))
    };
    compared.into_iter().map(of).collect()
}
