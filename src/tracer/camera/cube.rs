//! Pictures of all directions on the faces of a cube.

use glam::{DVec2, DVec3};

use crate::scene::desc::CubeLayout;

use super::local_ray::{FilmImage, LocalRay, OVERSCAN};

/// A face: its direction, and those of its right and its upper edge, in camera space, where x is to the left.
struct CubeFace {
    ahead: DVec3,
    right: DVec3,
    up: DVec3,
}

const FRONT: CubeFace = CubeFace { ahead: DVec3::Z, right: DVec3::NEG_X, up: DVec3::Y };
const RIGHT: CubeFace = CubeFace { ahead: DVec3::NEG_X, right: DVec3::NEG_Z, up: DVec3::Y };
const BACK: CubeFace = CubeFace { ahead: DVec3::NEG_Z, right: DVec3::X, up: DVec3::Y };
const LEFT: CubeFace = CubeFace { ahead: DVec3::X, right: DVec3::Z, up: DVec3::Y };
const UP: CubeFace = CubeFace { ahead: DVec3::Y, right: DVec3::NEG_X, up: DVec3::NEG_Z };
const DOWN: CubeFace = CubeFace { ahead: DVec3::NEG_Y, right: DVec3::NEG_X, up: DVec3::Z };

/// The faces by rows of the picture.
type Rows = &'static [&'static [Option<CubeFace>]];

const LINE: &[Option<CubeFace>] = &[Some(RIGHT), Some(LEFT), Some(UP), Some(DOWN), Some(FRONT), Some(BACK)];
const BLOCK: Rows = &[&[Some(RIGHT), Some(LEFT), Some(UP)], &[Some(DOWN), Some(FRONT), Some(BACK)]];
const COLUMN: Rows =
    &[&[Some(RIGHT)], &[Some(LEFT)], &[Some(UP)], &[Some(DOWN)], &[Some(FRONT)], &[Some(BACK)]];
const CROSS: Rows = &[
    &[None, Some(UP), None, None],
    &[Some(LEFT), Some(FRONT), Some(RIGHT), Some(BACK)],
    &[None, Some(DOWN), None, None],
];

/// The six faces of a cube, each a picture of 90 degrees. The overscan continues the planes of the faces at the film's edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct CubeMap {
    layout: CubeLayout,
}

impl CubeMap {
    pub(super) fn new(layout: CubeLayout) -> Self {
        Self { layout }
    }

    fn rows(self) -> Rows {
        match self.layout {
            CubeLayout::Block => BLOCK,
            CubeLayout::Row => &[LINE],
            CubeLayout::Column => COLUMN,
            CubeLayout::Cross => CROSS,
        }
    }

    /// Columns and rows.
    fn size(self) -> DVec2 {
        let rows = self.rows();
        DVec2::new(rows[0].len() as f64, rows.len() as f64)
    }

    /// Column and row of the face of a place of the film or its overscan.
    fn cell(self, at: DVec2) -> Option<DVec2> {
        let within = at.cmpge(DVec2::splat(-OVERSCAN)) & at.cmplt(DVec2::splat(1.0 + OVERSCAN));
        let size = self.size();
        within.all().then(|| (at * size).floor().clamp(DVec2::ZERO, size - 1.0))
    }

    fn face(self, cell: DVec2) -> Option<&'static CubeFace> {
        self.rows()[cell.y as usize][cell.x as usize].as_ref()
    }

    /// Area of the film per steradian around a direction of this squared length that reaches the plane of a face.
    fn density(self, length2: f64) -> f64 {
        let size = self.size();
        length2 * length2.sqrt() / (4.0 * size.x * size.y)
    }

    pub(super) fn ray(self, at: DVec2) -> Option<LocalRay> {
        let cell = self.cell(at)?;
        let CubeFace { ahead, right, up } = self.face(cell)?;
        let place = 2.0 * (at * self.size() - cell) - 1.0;
        let direction = *ahead + *right * place.x - *up * place.y;
        Some(LocalRay { from: DVec3::ZERO, direction, density: self.density(direction.length_squared()) })
    }

    /// Adds every place of the film and its overscan that shows a direction.
    pub(super) fn images(self, direction: DVec3, mut add: impl FnMut(FilmImage)) {
        let size = self.size();
        for y in 0..self.rows().len() {
            for x in 0..self.rows()[y].len() {
                let cell = DVec2::new(x as f64, y as f64);
                let Some(CubeFace { ahead, right, up }) = self.face(cell) else { continue };
                let depth = direction.dot(*ahead);
                if depth <= 0.0 {
                    continue;
                }
                let place = DVec2::new(direction.dot(*right), -direction.dot(*up)) / depth;
                let at = (cell + 0.5 * (place + 1.0)) / size;
                if self.cell(at) == Some(cell) {
                    let density = self.density(1.0 + place.length_squared());
                    add(FilmImage { at, ray: LocalRay { from: DVec3::ZERO, direction, density } });
                }
            }
        }
    }
}
