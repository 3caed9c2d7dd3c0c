//! The instruction sets that rays are traced with.

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
    pub(in crate::tracer) fn best() -> Self {
        SimdKernel::ALL.into_iter().rev().find_map(SimdKernel::available).unwrap_or(Self(SimdKernel::Scalar))
    }

    /// Which kernel it is.
    pub(in crate::tracer) fn get(self) -> SimdKernel {
        self.0
    }
}

/// Compiles a function for processors with AVX2 as well, and calls that of `kernel`.
///
/// With AVX-512 it is the same code: with registers of 512 bits renders took 6 to 13 % longer, presumably because the clock is lower.
macro_rules! for_kernel {
    ($(#[$doc:meta])* $vis:vis $name:ident => $body:ident($($argument:ident: $type:ty),*) -> $result:ty) => {
        $(#[$doc])*
        #[inline]
        $vis fn $name(kernel: $crate::tracer::accel::AvailableKernel, $($argument: $type),*) -> $result {
            #[cfg(target_arch = "x86_64")]
            {
                use $crate::tracer::accel::SimdKernel;

                #[target_feature(enable = "avx2")]
                fn avx2($($argument: $type),*) -> $result {
                    $body($($argument),*)
                }
                if let SimdKernel::Avx2 | SimdKernel::Avx512 = kernel.get() {
                    // SAFETY: the value of `AvailableKernel` proves that this processor has these instructions.
                    return unsafe { avx2($($argument),*) };
                }
            }
            let _ = kernel;
            $body($($argument),*)
        }
    };
}

pub(in crate::tracer) use for_kernel;
