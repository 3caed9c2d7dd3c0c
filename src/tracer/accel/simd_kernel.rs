//! The instruction sets for which the traversal is compiled.

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

    /// The fastest kernel that this processor can run.
    pub fn best() -> Self {
        Self::ALL.into_iter().rev().find(|k| k.is_available()).unwrap_or_default()
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
