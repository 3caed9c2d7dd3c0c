//! The number of photons, the radius and the number of neighbours as functions of the sample's index.
//!
//! The number of light paths is a linear function of the samples taken (paper §3.4):
//! `paths_per_generation · (1 + ⌊index / samples_per_generation⌋)`. Nothing here depends on a clock or a counter, so
//! index ranges that are rendered separately, by other threads or machines, fit together.
//!
//! **Radius.** r²_g = r²_1 · Π_{i=1}^{g−1} (i + α)/(i + 1) at generation g (Knaus and Zwicker 2011, *Progressive Photon
//! Mapping: A Probabilistic Approach*, eq. 15), which falls as g^(α−1). With all photons so far in the map, the
//! number in a disc grows as g^α. With α = 2/3 bias and noise at a point shrink together, but a sample costs more and more.
//! **With α = 0 the number stays bounded, and the cost is O(log n)**. Noise still vanishes, because a pixel and a final
//! gather are integrals over an area: their queries fall into ever more discs without common photons. The bias falls as
//! r², hence as 1/n for α = 0. Where photons are dense, `neighbours` bounds the work and the disc shrinks by itself.

/// How the photon map grows with the number of samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Schedule {
    /// Light paths of one generation.
    pub paths_per_generation: u64,
    /// Samples from one generation to the next.
    pub samples_per_generation: u64,
    /// Largest gather radius on surfaces at generation 1, m.
    pub radius: f32,
    /// Largest radius around flights in media at generation 1, m.
    pub beam_radius: f32,
    /// Exponent α of the radius, in [0, 1).
    pub alpha: f64,
    /// Most photons of one query.
    pub neighbours: usize,
}

/// The photon query of one sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lookup {
    /// Number of generations of the snapshot.
    pub generations: u64,
    /// Largest radius on surfaces, m.
    pub radius: f32,
    /// Radii around flights in media over those at the first generation.
    pub beam_share: f32,
    /// Most photons.
    pub neighbours: usize,
}

impl Schedule {
    /// Number of generations that sample `index` uses: at least one.
    #[inline]
    pub fn generations(&self, index: u64) -> u64 {
        1 + index / self.samples_per_generation
    }

    /// The query of a sample in a snapshot of so many generations.
    pub fn lookup(&self, generations: u64) -> Lookup {
        let share = self.radius_share(generations);
        let radius = (f64::from(self.radius) * share) as f32;
        Lookup { generations, radius, beam_share: share as f32, neighbours: self.neighbours }
    }

    /// Light paths that should have been started by sample `index`: those it needs, and a proportionate part of the next
    /// generation, which is complete three quarters of the way there so that its photons can be sorted in time.
    pub fn paths_ahead(&self, index: u64) -> u64 {
        let into = index % self.samples_per_generation + 1;
        let share = u128::from(self.paths_per_generation) * u128::from(into) * 4;
        let share = (share / (u128::from(self.samples_per_generation) * 3)) as u64;
        self.generations(index)
            .saturating_mul(self.paths_per_generation)
            .saturating_add(share.min(self.paths_per_generation))
    }

    /// The radius at `generation` ≥ 1, m. O(1).
    pub fn radius(&self, generation: u64) -> f32 {
        (f64::from(self.radius) * self.radius_share(generation)) as f32
    }

    /// The radii at `generation` ≥ 1 over those at the first.
    fn radius_share(&self, generation: u64) -> f64 {
        const EXACT: u64 = 32;
        let generation = generation.max(1);
        let product: f64 =
            (1..generation.min(EXACT)).map(|i| (i as f64 + self.alpha) / (i as f64 + 1.0)).product();
        let rest = if generation > EXACT {
            self.gamma_ratio(generation as f64) / self.gamma_ratio(EXACT as f64)
        } else {
            1.0
        };
        (product * rest).sqrt()
    }

    /// Γ(g + α)/Γ(g + 1) for g ≥ 32 within 1e-8 (Tricomi and Erdélyi 1951, in powers about the middle of the two arguments).
    fn gamma_ratio(&self, g: f64) -> f64 {
        let d = self.alpha - 1.0;
        let middle = g + self.alpha * 0.5;
        middle.powf(d) * (1.0 - d * (d - 1.0) * (d + 1.0) / (24.0 * middle * middle))
    }
}
