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

use super::bvh::{Accel, BvhRoot, Hit, PrimRange, Ray, TraversalFns};

pub(super) use stack::MAX_DEPTH;

/// An instruction set for the traversal. All give the same results, bit for bit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SimdKernel {
    /// Any processor.
    #[default]
    Scalar,
    /// x86-64 with AVX2, FMA and BMI.
    Avx2,
    /// x86-64 with these and AVX-512 (F, VL, DQ and BW).
    Avx512,
}

impl SimdKernel {
    /// All kernels, slowest first.
    pub const ALL: [SimdKernel; 3] = [SimdKernel::Scalar, SimdKernel::Avx2, SimdKernel::Avx512];

    /// True if this processor can run it.
    pub fn is_available(self) -> bool {
        match self {
            SimdKernel::Scalar => true,
            #[cfg(target_arch = "x86_64")]
            SimdKernel::Avx2 => {
                is_x86_feature_detected!("avx2")
                    && is_x86_feature_detected!("fma")
                    && is_x86_feature_detected!("bmi1")
                    && is_x86_feature_detected!("bmi2")
                    && is_x86_feature_detected!("lzcnt")
                    && is_x86_feature_detected!("popcnt")
            }
            #[cfg(target_arch = "x86_64")]
            SimdKernel::Avx512 => {
                SimdKernel::Avx2.is_available()
                    && is_x86_feature_detected!("avx512f")
                    && is_x86_feature_detected!("avx512vl")
                    && is_x86_feature_detected!("avx512dq")
                    && is_x86_feature_detected!("avx512bw")
            }
            #[cfg(not(target_arch = "x86_64"))]
            _ => false,
        }
    }

    /// This kernel, if this processor can run it.
    pub(in crate::tracer) fn available(self) -> Option<AvailableKernel> {
        self.is_available().then_some(AvailableKernel(self))
    }

    /// The fastest kernel that this processor can run.
    pub fn best() -> Self {
        AvailableKernel::best().get()
    }

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            SimdKernel::Scalar => "scalar",
            SimdKernel::Avx2 => "avx2",
            SimdKernel::Avx512 => "avx512",
        }
    }
}

/// A kernel that this processor can run. A value of the type proves it, so that safe functions may call code for these instructions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::tracer) struct AvailableKernel(SimdKernel);

impl AvailableKernel {
    /// The fastest.
    pub(super) fn best() -> Self {
        SimdKernel::ALL.into_iter().rev().find_map(SimdKernel::available).unwrap_or(Self(SimdKernel::Scalar))
    }

    /// Which kernel it is.
    pub(in crate::tracer) fn get(self) -> SimdKernel {
        self.0
    }
}

/// The traversals that are compiled for `kernel`, all of which this processor can run.
pub(super) fn traversals(kernel: AvailableKernel) -> TraversalFns {
    match kernel.get() {
        #[cfg(target_arch = "x86_64")]
        SimdKernel::Avx2 => TraversalFns { closest: avx2::closest, occluded: avx2::occluded },
        #[cfg(target_arch = "x86_64")]
        SimdKernel::Avx512 => TraversalFns { closest: avx512::closest, occluded: avx512::occluded },
        _ => TraversalFns { closest: any::closest, occluded: any::occluded },
    }
}

/// Both traversals over the lanes `$simd`, compiled with the instructions `$features`.
macro_rules! compile {
    ($name:ident, $simd:expr $(, $features:literal)?) => {
        mod $name {
            use super::*;

            $(#[target_feature(enable = $features)])?
            pub(super) fn closest(accel: &Accel, bvh: &BvhRoot, ray: &Ray, instance: u32, best: &mut Hit) {
                traverse::closest($simd, accel, bvh, ray, instance, best);
            }

            $(#[target_feature(enable = $features)])?
            pub(super) fn occluded(accel: &Accel, bvh: &BvhRoot, ray: &Ray, skip: PrimRange) -> bool {
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
