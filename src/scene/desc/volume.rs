//! Volume textures: values on a grid in space, evaluated at the position of a surface point. Mitsuba's `volume` with a `gridvolume`.

use std::sync::Arc;

use glam::{Affine3A, DAffine3, Vec3, Vec3A};

use super::rendering_space::RenderingSpace;
use super::wrap::WrapMode;

/// Values on a grid, one or three at each of its points.
#[derive(Debug)]
pub struct VolumeGrid {
    size: [usize; 3],
    channels: usize,
    values: Vec<f32>,
    /// Mean of the values; three equal ones for a single channel.
    mean: [f32; 3],
}

impl VolumeGrid {
    /// A grid of these numbers of points along x, y and z, with `channels` values at each, of which x runs fastest; colours in linear
    /// Rec.709 where there are three, and otherwise one number, their mean.
    ///
    /// # Panics
    ///
    /// If there is no point, or not as many values as the sizes say.
    pub fn new(size: [usize; 3], channels: usize, values: Vec<f32>) -> Self {
        let points = size.into_iter().product::<usize>();
        assert!(points > 0 && channels > 0 && values.len() == points * channels, "a value for every point");
        let (channels, values) = match channels {
            1 | 3 => (channels, values),
            _ => {
                (1, values.chunks_exact(channels).map(|v| v.iter().sum::<f32>() / channels as f32).collect())
            }
        };
        let mut sum = [0.0; 3];
        for point in values.chunks_exact(channels) {
            (0..3).for_each(|i| sum[i] += f64::from(usable(point[i % channels])));
        }
        Self { size, channels, values, mean: sum.map(|v| (v / points as f64) as f32) }
    }

    /// The grid of which `f` makes the values from those of this one, which has a single channel: `N` at each point.
    pub(crate) fn mapped<const N: usize>(&self, f: impl FnMut(f32) -> [f32; N]) -> Self {
        Self::new(self.size, N, self.values.iter().copied().flat_map(f).collect())
    }

    /// Number of values.
    pub(crate) fn len(&self) -> usize {
        self.values.len()
    }

    /// The values, channels fastest and then x.
    pub(super) fn values(&self) -> &[f32] {
        &self.values
    }

    /// True for a single channel.
    pub fn is_grey(&self) -> bool {
        self.channels == 1
    }

    /// The value at a point of the grid, which must exist.
    #[inline]
    fn at(&self, [x, y, z]: [usize; 3]) -> Vec3A {
        let first = ((z * self.size[1] + y) * self.size[0] + x) * self.channels;
        match self.channels {
            1 => Vec3A::splat(self.values[first]),
            _ => Vec3A::new(self.values[first], self.values[first + 1], self.values[first + 2]),
        }
    }
}

/// `v` clamped to [0, 1e30]; NaN becomes 0.
fn usable(v: f32) -> f32 {
    if v > 0.0 { v.min(1e30) } else { 0.0 }
}

/// Mitsuba's `volume` of a `gridvolume`.
#[derive(Clone, Debug)]
pub struct VolumeTexture {
    grid: Arc<VolumeGrid>,
    /// From the space of surfaces to the space in which the grid fills the unit cube.
    to_grid: DAffine3,
    /// `to_grid` in single precision.
    near: Affine3A,
    wrap: WrapMode,
    nearest: bool,
    /// Colours are replaced by their luminance.
    grey: bool,
}

impl VolumeTexture {
    /// A texture of a grid that fills the unit cube of the space to which `to_grid` transforms world space. Lookup is `nearest`-neighbour or
    /// trilinear.
    pub fn new(grid: Arc<VolumeGrid>, to_grid: DAffine3, wrap: WrapMode, nearest: bool) -> Self {
        Self { grid, to_grid, near: near(&to_grid), wrap, nearest, grey: false }
    }

    /// The texture in a rendering space.
    pub(super) fn placed(&self, space: &RenderingSpace) -> Self {
        let to_grid = self.to_grid * space.inverse_transform();
        Self { to_grid, near: near(&to_grid), ..self.clone() }
    }

    /// The values at a position, with `usable` applied to each grid point before interpolation.
    pub(super) fn value(&self, p: Vec3, usable: impl Fn(Vec3A) -> Vec3A) -> Vec3A {
        let size = self.grid.size;
        let lengths = Vec3::from_array(size.map(|n| n as f32));
        let at = self.near.transform_point3(p) * lengths;
        // Places that are no numbers, or beyond all integers, mean nothing.
        let at = if at.abs().cmplt(Vec3::splat(1e18)).all() { at } else { Vec3::ZERO };
        let at = if self.nearest { at } else { at - 0.5 };
        let cell = at.floor();
        let part = at - cell;
        let first = cell.to_array().map(|v| v as i64);
        let index = |axis: usize, upper: bool| {
            self.wrap.index(first[axis].saturating_add(i64::from(upper)), size[axis])
        };
        let value =
            |corner: usize| usable(self.grid.at([0, 1, 2].map(|axis| index(axis, corner >> axis & 1 == 1))));
        let value = if self.nearest {
            value(0)
        } else {
            let weight = |corner: usize| -> f32 {
                (0..3)
                    .map(|axis| if corner >> axis & 1 == 1 { part[axis] } else { 1.0 - part[axis] })
                    .product()
            };
            (0..8).map(|corner| value(corner) * weight(corner)).sum()
        };
        if self.grey { Vec3A::splat(value.dot(LUMINANCE)) } else { value }
    }

    /// The values at a position, for scalars.
    pub(super) fn number(&self, p: Vec3) -> [f32; 3] {
        self.value(p, |point| point.to_array().map(usable).into()).to_array()
    }

    /// The numbers of points of the grid along its axes.
    pub fn size(&self) -> [usize; 3] {
        self.grid.size
    }

    /// The place of the first point of the grid, in units of the distance between points from the corner of the unit cube: between planes through
    /// the points the values are one polynomial; those of a `nearest` lookup are constant between planes at whole units.
    pub fn first_point(&self) -> f32 {
        if self.nearest { 0.0 } else { 0.5 }
    }

    /// From the space of surfaces to the space in which the grid fills the unit cube.
    pub fn to_grid(&self) -> &DAffine3 {
        &self.to_grid
    }

    /// The values at a position, as [`coefficient`](Self::coefficient) has them.
    #[inline]
    pub fn coefficient_at(&self, p: Vec3) -> [f32; 3] {
        self.coefficient(self.near.transform_point3(p))
    }

    /// The values at a place in the space in which the grid fills the unit cube, for a coefficient of a medium: what is no number, not positive or
    /// not finite counts as 0.
    #[inline]
    pub fn coefficient(&self, at: Vec3) -> [f32; 3] {
        let size = self.grid.size;
        let at = at * Vec3::from_array(size.map(|n| n as f32)) - if self.nearest { 0.0 } else { 0.5 };
        let cell = at.floor();
        let part = if self.nearest { Vec3::ZERO } else { at - cell };
        let first = cell.to_array().map(|v| v as i64);
        let steps =
            [self.grid.channels, self.grid.channels * size[0], self.grid.channels * size[0] * size[1]];
        let lines: [[usize; 2]; 3] = [0, 1, 2].map(|axis| {
            [first[axis], first[axis].saturating_add(1)].map(|i| self.wrap.index(i, size[axis]) * steps[axis])
        });
        let values = &self.grid.values;
        let interpolated = |channel: usize| {
            let number = |x: usize, y: usize, z: usize| {
                let value = values[lines[0][x] + lines[1][y] + lines[2][z] + channel];
                if value > 0.0 && value < f32::INFINITY { value } else { 0.0 }
            };
            let mix = |a: f32, b: f32, share: f32| a + (b - a) * share;
            let along_x = |y, z| mix(number(0, y, z), number(1, y, z), part.x);
            let along_y = |z| mix(along_x(0, z), along_x(1, z), part.y);
            mix(along_y(0), along_y(1), part.z)
        };
        match self.grid.channels {
            1 => [interpolated(0); 3],
            _ => {
                let color = [interpolated(0), interpolated(1), interpolated(2)];
                if self.grey { [Vec3A::from(color).dot(LUMINANCE); 3] } else { color }
            }
        }
    }

    /// Upper bounds of all that [`coefficient`](Self::coefficient) returns, in `count` equal boxes along each axis, x fastest.
    pub fn bounds_of_coefficients(&self, count: [usize; 3]) -> Vec<f32> {
        let size = self.grid.size;
        // The points that a box interpolates between, and one more against rounding.
        let reach = |axis: usize, i: usize| {
            let at = |i: usize| i as f64 / count[axis] as f64 * size[axis] as f64;
            (at(i).floor() as i64 - 2)..=(at(i + 1).ceil() as i64 + 1)
        };
        let channels = self.grid.channels;
        let mut bounds = Vec::with_capacity(count.into_iter().product());
        for z in 0..count[2] {
            for y in 0..count[1] {
                for x in 0..count[0] {
                    let mut most = 0f32;
                    for k in reach(2, z).map(|k| self.wrap.index(k, size[2])) {
                        for j in reach(1, y).map(|j| self.wrap.index(j, size[1])) {
                            for i in reach(0, x).map(|i| self.wrap.index(i, size[0])) {
                                let first = ((k * size[1] + j) * size[0] + i) * channels;
                                let finite = self.grid.values[first..first + channels]
                                    .iter()
                                    .filter(|v| v.is_finite());
                                most = finite.fold(most, |most, v| most.max(*v));
                            }
                        }
                    }
                    bounds.push(most);
                }
            }
        }
        bounds
    }

    /// The mean of the values of the grid.
    pub fn mean(&self) -> [f32; 3] {
        if self.grey { [Vec3A::from(self.grid.mean).dot(LUMINANCE); 3] } else { self.grid.mean }
    }

    /// The largest value of the grid that is a number, at least 0.
    pub(super) fn largest(&self) -> f32 {
        self.grid.values.iter().copied().fold(0.0, f32::max)
    }

    /// The texture with the colours that `color` makes of the values of its grid, which has a single channel.
    pub(super) fn colored(&self, color: impl Fn(f32) -> [f32; 3]) -> Self {
        Self { grid: Arc::new(self.grid.mapped(color)), ..self.clone() }
    }

    /// True when the values have no colour.
    pub fn is_grey(&self) -> bool {
        self.grey || self.grid.is_grey()
    }

    /// The texture with colours replaced by their luminance.
    pub(super) fn grey(&self) -> Self {
        Self { grey: true, ..self.clone() }
    }
}

/// Weights of the luminance of a linear Rec.709 colour.
const LUMINANCE: Vec3A = Vec3A::new(0.2126, 0.7152, 0.0722);

fn near(to_grid: &DAffine3) -> Affine3A {
    Affine3A::from_mat3_translation(to_grid.matrix3.as_mat3(), to_grid.translation.as_vec3())
}
