//! Numbers for one path: fixed dimension slots per path vertex, `../shared/qmc.md`.

/// The numbers of one path. Every number has a fixed slot: a dimension always means the same thing.
#[derive(Clone, Copy, Debug)]
pub struct Sampler {
    index: u64,
    seed: u32,
}

/// Numbers for the start of a camera path; all in [0, 1).
#[derive(Clone, Copy, Debug)]
pub struct CameraNumbers {
    /// Position over the whole window, 32 bits of precision kept until the splat.
    pub screen: [f64; 2],
    /// Position on the lens.
    pub lens: [f32; 2],
    /// Wavelength.
    pub wavelength: f32,
    /// Time.
    pub time: f32,
}

/// Numbers for one vertex of a path; all in [0, 1).
#[derive(Clone, Copy, Debug)]
pub struct VertexNumbers {
    /// Point on the light.
    pub light: [f32; 2],
    /// Direction of the BSDF.
    pub bsdf: [f32; 2],
    /// Which light.
    pub light_choice: f32,
    /// Which lobe of the BSDF.
    pub lobe: f32,
    /// Russian roulette.
    pub roulette: f32,
}

impl Sampler {
    /// The numbers of path `index` under `seed`.
    pub fn at(index: u64, seed: u32) -> Self {
        Self { index, seed }
    }

    /// Numbers for the camera.
    pub fn camera(&self) -> CameraNumbers {
        CameraNumbers {
            screen: [f64::from(self.hash(0)), f64::from(self.hash(1))],
            lens: [self.hash(2), self.hash(3)],
            wavelength: self.hash(4),
            time: self.hash(5),
        }
    }

    /// Numbers for vertex `depth`; 0 is the first surface point after the camera.
    pub fn vertex(&self, depth: u32) -> VertexNumbers {
        let d = 16 + depth * 8;
        VertexNumbers {
            light: [self.hash(d), self.hash(d + 1)],
            bsdf: [self.hash(d + 2), self.hash(d + 3)],
            light_choice: self.hash(d + 4),
            lobe: self.hash(d + 5),
            roulette: self.hash(d + 6),
        }
    }

    /// PLACEHOLDER (splitmix64); helper `stream` replaces the whole file by NX8.
    fn hash(&self, dim: u32) -> f32 {
        let mut z =
            self.index.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ (u64::from(dim) << 32 | u64::from(self.seed));
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 40) as f32 / 16_777_216.0
    }
}
