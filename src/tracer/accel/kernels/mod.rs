//! The walks, one body compiled for every kind of processor.
//!
//! `walk` is the body, over the eight lanes of `lanes`; `scalar` and `x86` are lanes. A function here is a body with the
//! instructions it may use. All find the same: what decides on a hit is IEEE arithmetic in one order.

mod lanes;
mod polygon;
mod ray;
mod scalar;
mod stack;
mod walk;
#[cfg(target_arch = "x86_64")]
mod x86;

use super::dispatch::Kernel;
use super::tree::{Part, Tree};
use super::{Hit, PrimRange, Ray};

pub(super) use stack::MAX_DEPTH;

/// The two questions, answered by the instructions of one [`Kernel`], which the processor must have.
#[derive(Clone, Copy, Debug)]
pub(super) struct Walks {
    /// Puts what is hit in a part of a tree, as seen through an instance, before the given hit in its place.
    pub(super) closest: unsafe fn((&Tree, &Part), &Ray, u32, &mut Hit),
    /// True when anything in a part of a tree is hit but some primitives.
    pub(super) occluded: unsafe fn((&Tree, &Part), &Ray, PrimRange) -> bool,
}

impl Walks {
    pub(super) fn of(kernel: Kernel) -> Self {
        match kernel {
            #[cfg(target_arch = "x86_64")]
            Kernel::Avx2 => Self { closest: avx2::closest, occluded: avx2::occluded },
            #[cfg(target_arch = "x86_64")]
            Kernel::Avx512 => Self { closest: avx512::closest, occluded: avx512::occluded },
            _ => Self { closest: any::closest, occluded: any::occluded },
        }
    }
}

impl Default for Walks {
    fn default() -> Self {
        Self::of(Kernel::default())
    }
}

/// Both walks over `$lanes` with the instructions `$features`.
macro_rules! walks {
    ($name:ident, $lanes:expr $(, $features:literal)?) => {
        mod $name {
            use super::*;

            $(#[target_feature(enable = $features)])?
            pub(super) fn closest(part: (&Tree, &Part), ray: &Ray, instance: u32, best: &mut Hit) {
                walk::closest($lanes, part, ray, instance, best);
            }

            $(#[target_feature(enable = $features)])?
            pub(super) fn occluded(part: (&Tree, &Part), ray: &Ray, skip: PrimRange) -> bool {
                walk::occluded($lanes, part, ray, skip)
            }
        }
    };
}

walks!(any, scalar::Scalar);
#[cfg(target_arch = "x86_64")]
walks!(
    avx2,
    // SAFETY: the features are those the function is compiled with.
    unsafe { x86::X86::<false>::new() },
    "avx2,fma,bmi1,bmi2,lzcnt,popcnt"
);
#[cfg(target_arch = "x86_64")]
walks!(
    avx512,
    // SAFETY: the features are those the function is compiled with.
    unsafe { x86::X86::<true>::new() },
    "avx2,fma,bmi1,bmi2,lzcnt,popcnt,avx512f,avx512vl,avx512dq,avx512bw"
);
