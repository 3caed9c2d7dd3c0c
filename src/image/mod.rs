//! Pictures as plain data: pixel grids, EXR and PNG files, comparison of pictures.
//!
//! A leaf: knows colour and mathematics, and nothing of tracers, films or devices.

pub mod grid;

pub use grid::Grid;
