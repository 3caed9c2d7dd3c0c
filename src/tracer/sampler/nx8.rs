//! NX8: an 8-dimensional digital (1, 8)-sequence in base 4, computed from its function field.
//!
//! The construction is that of C. Xing and H. Niederreiter, *A construction of low-discrepancy sequences using global
//! function fields* (1995), with the field of the elliptic curve y² + y = x³ over F₄ (genus 1, nine rational places). Let g₀,
//! g₁, … be the functions whose only pole is at infinity, by the order of that pole. Point n = Σ nᵣ 4ʳ belongs to the
//! function Σ nᵣ gᵣ, and the base-4 digits of coordinate i are the local expansion of that function at place i. By the
//! theorem of Riemann and Roch every elementary interval contains its share of points, with t equal to the genus 1.
//!
//! The construction has two degrees of freedom: all g vanish at one more place (a divisor E), and every digit is multiplied
//! by a constant of F₄ (`RHO`). Neither changes t in base 4. Together they make the pairs (0, 1), (2, 3), (4, 5) nearly
//! perfect in base 2, whereas without them the screen pair has holes.

use std::sync::LazyLock;

/// Dimensions of one block.
pub const DIMENSIONS: usize = 8;

/// The generator matrices: `columns()[d][k]` is XORed to coordinate `d`, a 64-bit fixed-point fraction, if bit `k` of the
/// index is set.
pub type Columns = [[u64; 64]; DIMENSIONS];

/// Coefficients t⁰ … t³² of a power series over F₄.
type PowerSeries = [u8; TERMS];

const TERMS: usize = 33;
const DIGITS: usize = 32;

/// Multiplication of F₄ = {0, 1, w, w²}, written 0, 1, 2, 3; addition is XOR.
const MUL: [[u8; 4]; 4] = [[0, 0, 0, 0], [0, 1, 2, 3], [0, 2, 3, 1], [0, 3, 1, 2]];

/// The finite rational places (x, y) of the curve. The last one is the divisor E.
const PLACES: [(u8, u8); DIMENSIONS] = [(0, 0), (0, 1), (1, 2), (1, 3), (2, 2), (2, 3), (3, 2), (3, 3)];

/// Multiplier of digit `j` in dimension `i`: `RHO[i][j % 3]`, found by exhaustive search over base-2 quality.
const RHO: [[u8; 3]; DIMENSIONS] =
    [[3, 2, 2], [1, 3, 1], [1, 2, 1], [2, 3, 3], [3, 2, 3], [2, 3, 2], [2, 3, 2], [2, 3, 3]];

/// The generator matrices, computed on first use in some ten microseconds.
pub fn columns() -> &'static Columns {
    static COLUMNS: LazyLock<Columns> = LazyLock::new(compute);
    &COLUMNS
}

/// The unscrambled point `index` as 64-bit fractions. Do not render with it: index 0 is the corner (0, …, 0).
pub fn point(index: u64) -> [u64; DIMENSIONS] {
    let mut x = [0; DIMENSIONS];
    for (x, columns) in x.iter_mut().zip(columns()) {
        for (k, column) in columns.iter().enumerate() {
            *x ^= if index >> k & 1 == 1 { *column } else { 0 };
        }
    }
    x
}

/// The eight coordinates of a point, as 32-bit fractions.
pub type Coordinates = [u32; DIMENSIONS];

/// Entry `n` of table `k` is the XOR of the columns of the index bits that are set in `n`, where nibble `k` of the
/// **bit-reversed** index is `n`. Tables 0–7 are for the low half of the index, 8–15 for the high half. Of each coordinate
/// the top 32 bits are stored, also bit-reversed, because the scramble works on reversed words. With 8 KiB the tables fit
/// into the first-level cache.
type NibbleTables = [[Coordinates; 16]; 16];

#[inline]
fn tables() -> &'static NibbleTables {
    static TABLES: LazyLock<Box<NibbleTables>> = LazyLock::new(|| {
        let mut tables = Box::new([[[0; DIMENSIONS]; 16]; 16]);
        for (k, table) in tables.iter_mut().enumerate() {
            for (n, entry) in table.iter_mut().enumerate() {
                // Bit j of nibble k of a reversed half is bit 31 − (4k + j) of that half.
                let half_base = if k < 8 { 0 } else { 32 };
                let index = (0..4).fold(0u64, |index, j| {
                    index | (n as u64 >> j & 1) << (half_base + 31 - (4 * (k % 8) + j))
                });
                *entry = point(index).map(|x| ((x >> 32) as u32).reverse_bits());
            }
        }
        tables
    });
    &TABLES
}

/// The index as bit-reversed halves `[low, high]`.
#[inline(always)]
pub fn reversed_halves(index: u64) -> [u32; 2] {
    [(index as u32).reverse_bits(), ((index >> 32) as u32).reverse_bits()]
}

/// The unscrambled point of an index (as reversed halves), with bit-reversed coordinates.
#[inline(always)]
pub fn point_reversed([low, high]: [u32; 2]) -> Coordinates {
    let tables = tables();
    let mut x = [0; DIMENSIONS];
    for k in 0..8 {
        xor(&mut x, &tables[k][(low >> (4 * k) & 15) as usize]);
    }
    // For indices below 2^32 the high half is 0, also after the shuffle.
    if high != 0 {
        for k in 0..8 {
            xor(&mut x, &tables[8 + k][(high >> (4 * k) & 15) as usize]);
        }
    }
    x
}

#[inline(always)]
fn xor(x: &mut Coordinates, entry: &Coordinates) {
    for d in 0..DIMENSIONS {
        x[d] ^= entry[d];
    }
}

fn compute() -> Columns {
    let mut columns = [[0; 64]; DIMENSIONS];
    for (i, &place) in PLACES.iter().enumerate() {
        let functions = functions_at(place);
        // At E itself every g vanishes, so the expansion starts one term later.
        let shift = usize::from(i == DIMENSIONS - 1);
        for (r, g) in functions.iter().enumerate() {
            for (j, &c) in g[shift..shift + DIGITS].iter().enumerate() {
                let c = MUL[usize::from(RHO[i][j % 3])][usize::from(c)];
                for e in 0..2 {
                    let digit = MUL[usize::from(c)][1 + e];
                    columns[i][2 * r + e] |= u64::from(digit) << (62 - 2 * j);
                }
            }
        }
    }
    columns
}

/// g₀ … g₃₁ expanded at `place`: 1, x, y, x², xy, x³, … without the constant, each minus its value at E.
fn functions_at(place: (u8, u8)) -> [PowerSeries; DIGITS] {
    let (x, y) = coordinates(place);
    let (e_x, e_y) = PLACES[DIMENSIONS - 1];
    let mut x_power = one(1);
    let mut e_power = 1;
    let mut out = [[0; TERMS]; DIGITS];
    for (r, out) in out.iter_mut().enumerate() {
        // Pole orders 2, 3, 4, …: even orders are powers of x, odd ones a power of x times y.
        let order = r + 2;
        let (mut f, at_e) = if order % 2 == 0 {
            (x_power, e_power) = (multiply(&x_power, &x), MUL[usize::from(e_power)][usize::from(e_x)]);
            (x_power, e_power)
        } else {
            let (lower, e_lower) = power(&x, e_x, (order - 3) / 2);
            (multiply(&lower, &y), MUL[usize::from(e_lower)][usize::from(e_y)])
        };
        f[0] ^= at_e;
        *out = f;
    }
    out
}

/// `x^n` and its value at E.
fn power(x: &PowerSeries, e_x: u8, n: usize) -> (PowerSeries, u8) {
    (0..n).fold((one(1), 1), |(f, e), _| (multiply(&f, x), MUL[usize::from(e)][usize::from(e_x)]))
}

/// x and y as series in the local parameter t = x − x₀: x = x₀ + t, and y = y₀ + p + p² + p⁴ + … with
/// p = x³ − x₀³, which solves y² + y = x³.
fn coordinates((x0, y0): (u8, u8)) -> (PowerSeries, PowerSeries) {
    let mut x = one(x0);
    x[1] = 1;
    let mut p = multiply(&multiply(&x, &x), &x);
    p[0] = 0;
    let mut y = one(y0);
    while p.iter().any(|&c| c != 0) {
        for (y, p) in y.iter_mut().zip(p) {
            *y ^= p;
        }
        p = multiply(&p, &p);
    }
    (x, y)
}

fn one(c: u8) -> PowerSeries {
    let mut s = [0; TERMS];
    s[0] = c;
    s
}

fn multiply(a: &PowerSeries, b: &PowerSeries) -> PowerSeries {
    let mut out = [0; TERMS];
    for (i, &a) in a.iter().enumerate().filter(|(_, a)| **a != 0) {
        for (out, &b) in out[i..].iter_mut().zip(b) {
            *out ^= MUL[usize::from(a)][usize::from(b)];
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_series_solves_the_curve_equation() {
        for place in PLACES {
            let (x, y) = coordinates(place);
            let mut left = multiply(&y, &y);
            left.iter_mut().zip(y).for_each(|(l, y)| *l ^= y);
            assert_eq!(left, multiply(&multiply(&x, &x), &x), "place {place:?}");
        }
    }

    #[test]
    fn fingerprint_of_all_columns() {
        let mut hash = 0xcbf2_9ce4_8422_2325_u64;
        for byte in columns().iter().flatten().flat_map(|c| c.to_le_bytes()) {
            hash = (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
        }
        assert_eq!(hash, 0x0411_741a_9ada_f212);
    }
}
