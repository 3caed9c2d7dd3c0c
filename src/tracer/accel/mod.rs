//! Ray intersection: the closest hit, and whether anything occludes a segment.
//!
//! # Structure
//!
//! The accelerator is a bounding volume hierarchy with eight children per node (a BVH8). It is built in four steps:
//!
//! 1. `binary`: a binary BVH by the surface area heuristic (SAH), improved by reinsertion with obvhs.
//! 2. `collapse`: dynamic programming over the SAH selects which of its nodes become wide nodes, and which become leaves.
//! 3. `write`: nodes and leaf blocks are written to memory in depth-first order, in the format that `layout` describes.
//! 4. `build` drives these steps for the world and for each group of `shapes`.
//!
//! `refit` writes the same tree for primitives that have moved.
//!
//! Triangles and parallelograms are stored in blocks of eight. Disks, spheres, cylinders, curves and instances are leaves of their own. An
//! instance shows a group, which has a root of its own in the same memory.
//!
//! `kernels` traverses the BVH: one generic traversal, compiled for each SIMD instruction set and selected at run time.
//! obvhs's own traversal is not used, because it drops hits nearer than 1e-4 and its triangle test is not watertight.
//!
//! # Results
//!
//! Primitive ids: `0 .. triangles` are triangles, then disks, then spheres, then cylinders, then curves, each in the caller's order. Of several hits at
//! the same distance the one with the lowest id is reported, so that no result depends on the order of traversal.

mod binary;
mod build;
mod bvh;
mod collapse;
mod kernels;
mod layout;
mod ray;
mod refit;
mod shapes;
mod simd_kernel;
mod write;

pub use bvh::Accel;
pub use ray::{Hit, HitId, PrimRange, Ray};
pub use shapes::{Instance, PrimitiveGroup, Shapes, TriangleSource};
pub use simd_kernel::SimdKernel;
pub(in crate::tracer) use simd_kernel::{AvailableKernel, for_kernel};
