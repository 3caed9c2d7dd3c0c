//! The traversal kernels: one generic body, compiled for each SIMD instruction set.
//!
//! - `simd` is the interface to eight lanes of some processor, which `scalar` and `x86` implement.
//! - `ray` prepares a ray for the box test and for the polygon test (`polygon`), `stack` is the traversal stack, and
//!   `traverse` is the loop.
//!
//! All kernels find the same hits: the arithmetic that decides on a hit is IEEE arithmetic in one order.

mod polygon;
mod ray;
mod scalar;
mod simd;
mod stack;
mod traverse;
#[cfg(target_arch = "x86_64")]
mod x86;

use super::bvh::{Accel, BvhRoot, TraversalFns};
use super::ray::{Hit, HitId, PrimRange, Ray};
use super::simd_kernel::{AvailableKernel, SimdKernel};

pub(super) use stack::MAX_DEPTH;

/// The traversals that are compiled for `kernel`, all of which this processor can run.
pub(super) fn traversals(kernel: AvailableKernel) -> TraversalFns {
    match kernel.get() {
        #[cfg(target_arch = "x86_64")]
        SimdKernel::Avx2 => avx2::TRAVERSALS,
        #[cfg(target_arch = "x86_64")]
        SimdKernel::Avx512 => avx512::TRAVERSALS,
        _ => any::TRAVERSALS,
    }
}

/// All traversals over the lanes `$simd`, compiled with the instructions `$features`.
macro_rules! compile {
    ($name:ident, $simd:expr $(, $features:literal)?) => {
        mod $name {
            use super::*;

            pub(super) const TRAVERSALS: TraversalFns = TraversalFns { closest, closest_except, occluded };

            $(#[target_feature(enable = $features)])?
            fn closest(accel: &Accel, bvh: &BvhRoot, ray: &Ray, instance: u32, best: &mut Hit) {
                traverse::closest::<_, false>($simd, accel, bvh, ray, &[], instance, best);
            }

            $(#[target_feature(enable = $features)])?
            fn closest_except(
                accel: &Accel,
                bvh: &BvhRoot,
                ray: &Ray,
                skip: &[HitId],
                instance: u32,
                best: &mut Hit,
            ) {
                traverse::closest::<_, true>($simd, accel, bvh, ray, skip, instance, best);
            }

            $(#[target_feature(enable = $features)])?
            fn occluded(accel: &Accel, bvh: &BvhRoot, ray: &Ray, skip: PrimRange) -> bool {
                traverse::occluded($simd, accel, bvh, ray, skip)
            }
        }
    };
}

compile!(any, scalar::Scalar);
#[cfg(target_arch = "x86_64")]
compile!(
    avx2,
    // SAFETY: the features are those the function is compiled with.
    unsafe { x86::X86::<false>::new() },
    "avx2,fma,bmi1,bmi2,lzcnt,popcnt"
);
#[cfg(target_arch = "x86_64")]
compile!(
    avx512,
    // SAFETY: the features are those the function is compiled with.
    unsafe { x86::X86::<true>::new() },
    "avx2,fma,bmi1,bmi2,lzcnt,popcnt,avx512f,avx512vl,avx512dq,avx512bw"
);
