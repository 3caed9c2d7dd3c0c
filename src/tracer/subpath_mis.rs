//! The sums over strategies that bidirectional MIS weights are made of, carried on while a subpath grows.
//!
//! A path of n + 1 vertices can be found by several strategies, which differ in how many of its vertices come from the
//! light. Relative to the strategy that found it, the densities of the others are products of quotients: moving vertex j to
//! the other subpath multiplies the density of the path by qⱼ = revⱼ / fwdⱼ, its density per area seen from the other end
//! over that of the walk. With the power heuristic the weight is 1 / (1 + Σ products²), one sum per subpath (Veach 1997,
//! §10.2.1). Seen from vertex n the sum is
//!
//! ```text
//! Sₙ² = qₙ² (cₙ² + qₙ₋₁² (cₙ₋₁² + … ))     Sₙ = qₙ · hypot(cₙ, Sₙ₋₁)
//! ```
//!
//! where cⱼ, the *link*, belongs to the strategy in which j is the first vertex of the other side. It is 0 where that is
//! impossible, since the edge to vertex j − 1 ends at a delta, else the number of samples that the strategy counts as
//! ([`CONNECTION_SAMPLES`], another number for the connection to the camera); for next-event estimation, which does not choose
//! the light's vertex as the walk does, it is the quotient of the two densities. Sₙ and Sₙ₋₁ depend on what
//! vertex n is connected to, Sₙ₋₂ does not: it is the *tail* that a walk carries on (after Georgiev, *Implementing Vertex
//! Connection and Merging*, 2012, and van Antwerpen 2011, who carry the same for the balance heuristic).
//!
//! A Dirac density is counted as 1 on both sides, where it cancels. The roots of the sums are carried, in `f64`, and squared only
//! where that is finite: a quotient of two `f32` lies within 10^±83, so that three of the largest in a row can neither overflow nor
//! vanish, and no infinity meets a zero.

/// Samples that the connection of two subpaths counts as in weights, for one of next-event estimation: a camera vertex chooses between many
/// light vertices by what they would contribute. Measured in `bidirectional/connections.rs`.
pub const CONNECTION_SAMPLES: f32 = 4.0;

/// Largest sum that is carried.
const LARGEST: f64 = f64::MAX;

/// Sums above this outweigh every link, whose square does not exceed 10^166.
const OUTWEIGHS: f64 = 1e100;

/// `a / b`, where equal infinities (or zeros) give 1 and nothing gives NaN.
#[inline]
pub fn quotient(a: f32, b: f32) -> f64 {
    if a == b {
        return 1.0;
    }
    let q = f64::from(a) / f64::from(b);
    // NaN comes from a NaN only: such a strategy is taken as impossible.
    if q.is_nan() { 0.0 } else { q.min(LARGEST) }
}

/// √(link² + sum²), where the square of a large sum may be infinite.
#[inline]
fn join(link: f32, sum: f64) -> f64 {
    let link = f64::from(link);
    // A NaN in the link fails the comparison.
    let squares = sum * sum + if link > 0.0 { link * link } else { 0.0 };
    if sum > OUTWEIGHS { sum } else { squares.sqrt().min(LARGEST) }
}

/// The MIS weight of a strategy whose alternatives have the sums `camera` and `light`: in [0, 1].
#[inline]
pub fn weight(camera: f64, light: f64) -> f32 {
    (1.0 / (1.0 + camera * camera + light * light)) as f32
}

/// Densities at vertex n of a subpath, from which the MIS weight over all strategies is computed. They are per unit of area.
#[derive(Clone, Copy, Debug)]
pub struct SubpathMis {
    /// Density of this vertex by the walk.
    pub fwd: f32,
    /// Density per steradian with which vertex n − 1 chose its direction; 1 after a delta.
    pub fwd_w: f32,
    /// Takes a density per steradian here to one per area at vertex n − 1: |cos| / d²; 1 where vertex n − 1 is a
    /// direction.
    pub back: f32,
    /// cₙ, where this vertex is no delta: for light that goes on to the side it came from, and for light that goes on
    /// to the other side.
    pub link: [f32; 2],
    /// Density of vertex n − 1 by the walk.
    pub previous_fwd: f32,
    /// cₙ₋₁.
    pub previous_link: f32,
    /// Sₙ₋₂.
    pub tail: f64,
}

impl SubpathMis {
    /// Sₙ₋₁, if vertex n − 1 is chosen from here with density `rev_w` per steradian.
    #[inline]
    pub fn previous_sum(&self, rev_w: f32) -> f64 {
        let q = quotient(rev_w, self.previous_fwd) * f64::from(self.back);
        (q * join(self.previous_link, self.tail)).min(LARGEST)
    }

    /// Sₙ, if this vertex is chosen with density `rev` per area from the other side, and vertex n − 1 with `rev_w` per
    /// steradian from here; `through` tells that the connected vertex lies on the other side of the surface.
    #[inline]
    pub fn sum(&self, rev: f32, rev_w: f32, through: bool) -> f64 {
        let before = join(self.link[usize::from(through)], self.previous_sum(rev_w));
        (quotient(rev, self.fwd) * before).min(LARGEST)
    }
}
