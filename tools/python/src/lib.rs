//! The native half of the Python package `pointillist`: scenes, renders and pictures, as plain as they can be.
//!
//! What users see is Python (`python/pointillist`): names of options, dictionaries, progress. This crate loads, renders on threads that do not
//! hold the interpreter's lock, and hands arrays over without a copy.
//!
//! | file | what |
//! |---|---|
//! | `scene.rs` | a scene, its changes, a render of it |
//! | `progressive.rs` | a render on a thread of its own, and its pictures |
//! | `picture.rs` | a picture and its arrays; metrics of two |
//! | `errors.rs` | errors as exceptions |

mod errors;
mod picture;
mod progressive;
mod scene;

use pointillist::cmd::library;
use pyo3::prelude::*;

use errors::{RenderError, SceneError};
use picture::NativePicture;
use progressive::Pictures;
use scene::NativeScene;

/// Runs the program with these words behind its name, and returns its exit code.
#[pyfunction]
fn command(py: Python<'_>, words: Vec<String>) -> u8 {
    py.detach(|| library::command(&words))
}

/// The kinds of plugins, and the names of those that are read.
#[pyfunction]
fn plugins() -> Vec<(&'static str, Vec<&'static str>)> {
    pointillist::scene::mitsuba::plugin_names()
}

#[pymodule]
fn _native(module: &Bound<'_, PyModule>) -> PyResult<()> {
    library::prepare_process();
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    let scene_error = module.py().get_type::<SceneError>();
    // What an exception has that Python makes: every attribute, and no place.
    scene_error.setattr("file", "")?;
    scene_error.setattr("line", 0)?;
    scene_error.setattr("column", 0)?;
    scene_error.setattr("help", module.py().None())?;
    scene_error.setattr("entry", "")?;
    module.add("SceneError", scene_error)?;
    module.add("RenderError", module.py().get_type::<RenderError>())?;
    module.add_class::<NativeScene>()?;
    module.add_class::<NativePicture>()?;
    module.add_class::<Pictures>()?;
    module.add_function(wrap_pyfunction!(command, module)?)?;
    module.add_function(wrap_pyfunction!(plugins, module)?)?;
    module.add_function(wrap_pyfunction!(picture::compare, module)?)?;
    module.add_function(wrap_pyfunction!(picture::read, module)?)?;
    Ok(())
}
