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
//! impossible, since the edge to vertex j − 1 ends at a delta, else 1; for next-event estimation, which does not choose
//! the light's vertex as the walk does, it is the quotient of the two densities. Sₙ and Sₙ₋₁ depend on what
//! vertex n is connected to, Sₙ₋₂ does not: it is the *tail* that a walk carries on (after Georgiev, *Implementing Vertex
//! Connection and Merging*, 2012, and van Antwerpen 2011, who carry the same for the balance heuristic).
//!
//! A Dirac density is counted as 1 on both sides, where it cancels. The roots of the sums are carried, in `f64`: a
//! quotient of two `f32` lies within 10^±83, so that three of them in a row can neither overflow nor vanish, and no
//! infinity meets a zero.

/// Largest sum that is carried. Its square is still finite.
const LARGEST: f64 = 1e150;

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

/// √(link² + sum²), bounded.
#[inline]
fn join(link: f32, sum: f64) -> f64 {
    let link = f64::from(link);
    // A NaN in the link fails the comparison.
    let squares = sum * sum + if link > 0.0 { link * link } else { 0.0 };
    squares.min(LARGEST * LARGEST).sqrt()
}

/// The MIS weight of a strategy whose alternatives have the sums `camera` and `light`: in [0, 1].
#[inline]
pub fn weight(camera: f64, light: f64) -> f32 {
    (1.0 / (1.0 + camera * camera + light * light)) as f32
}

/// What vertex n of a subpath knows about the other strategies to find it. Densities are per unit of area.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Random;

    /// The densities of a path by light and camera walk at all vertices: the weights of the strategies, naively and by sums.
    fn weights(light: &[f32], camera: &[f32], solid: bool) -> (Vec<f64>, Vec<f64>) {
        let n = light.len();
        let way = |s: usize| -> f64 {
            light[..s].iter().chain(&camera[s..]).map(|&p| f64::from(p).ln()).sum::<f64>()
        };
        // In logarithms, and relative to the largest: this one cannot overflow.
        let logs: Vec<f64> = (1..n).map(way).collect();
        let top = logs.iter().copied().fold(f64::MIN, f64::max);
        let total: f64 = logs.iter().map(|l| (2.0 * (l - top)).exp()).sum();
        let exact = logs.iter().map(|l| (2.0 * (l - top)).exp() / total).collect();
        let back = if solid { 0.25 } else { 1.0 };
        let chained = (1..n)
            .map(|s| {
                let ends: Vec<(f32, f32)> = light.iter().copied().zip(camera.iter().copied()).collect();
                let from_light = sum_of(&ends[..s], back);
                let from_camera: Vec<(f32, f32)> = ends[s..].iter().rev().map(|&(l, c)| (c, l)).collect();
                f64::from(weight(sum_of(&from_camera, back), from_light))
            })
            .collect();
        (exact, chained)
    }

    /// S of the last of these (fwd, rev); its first vertex stays where it is, as a camera or an unhittable light.
    fn sum_of(walk: &[(f32, f32)], back: f32) -> f64 {
        let mut tail = 0.0;
        let mut last = 0.0;
        for n in 1..walk.len() {
            let mis = SubpathMis {
                fwd: walk[n].0,
                fwd_w: walk[n].0,
                back,
                link: [1.0; 2],
                previous_fwd: walk[n - 1].0,
                previous_link: if n == 1 { 0.0 } else { 1.0 },
                tail,
            };
            let rev_w = walk[n - 1].1 / back;
            last = mis.sum(walk[n].1, rev_w, false);
            tail = mis.previous_sum(rev_w);
        }
        last
    }

    /// Densities over the whole range of f32, paths of up to seven vertices.
    #[test]
    fn weights_are_a_partition_of_one_over_the_whole_range() {
        let mut random = Random(7);
        let mut next = || random.f32();
        let (mut naive_failures, mut compared) = (0, 0);
        for round in 0..20_000 {
            let n = 3 + round % 5;
            // Up to four vertices over the whole range; longer paths over what a scene of any size could have.
            let range = if n <= 5 { 37.0 } else { 15.0 };
            let mut draw = || (0..n).map(|_| 10f32.powf(range * (2.0 * next() - 1.0))).collect::<Vec<f32>>();
            let (light, camera) = (draw(), draw());
            let (exact, chained) = weights(&light, &camera, round % 2 == 0);
            let total: f64 = chained.iter().sum();
            assert!(chained.iter().all(|w| (0.0..=1.0).contains(w)), "{light:?} {camera:?}: {chained:?}");
            assert!((total - 1.0).abs() < 2e-6, "{light:?} {camera:?}: {chained:?} for {exact:?}");
            for (a, b) in exact.iter().zip(&chained) {
                assert!((a - b).abs() < 2e-6, "{light:?} {camera:?}: {chained:?} for {exact:?}");
                compared += 1;
            }
            let squares: f32 = light.iter().map(|p| p * p).product();
            naive_failures += usize::from(!squares.is_normal());
        }
        assert!(compared > 60_000 && naive_failures > 10_000, "the case is too easy: {naive_failures}");
    }

    #[test]
    fn no_pair_of_values_gives_nan() {
        let values = [0.0, 1e-45, 1.0, f32::MAX, f32::INFINITY, f32::NAN];
        for a in values {
            for b in values {
                for link in values {
                    let mis = SubpathMis {
                        fwd: a,
                        fwd_w: a,
                        back: b.min(1e38),
                        link: [link; 2],
                        previous_fwd: b,
                        previous_link: link,
                        tail: LARGEST,
                    };
                    let w = weight(mis.sum(b, a, false), 0.0);
                    assert!((0.0..=1.0).contains(&w), "{a} {b} {link}: {w}");
                }
            }
        }
    }
}
