//! Which method wins where: a grid over the picture.

use crate::study::data::Regions;
use crate::study::pages::escape::picture;
use crate::study::pages::number::{THIN, plain};
use crate::study::pages::plot::{Look, Size, Svg};

/// A map of winners.
pub struct Map<'a> {
    /// What it shows, for those who hear it.
    pub label: String,
    /// The winners.
    pub regions: &'a Regions,
    /// Name and look of each method.
    pub methods: Vec<(&'a str, Look)>,
    /// The picture's height over its width.
    pub aspect: f64,
    /// The picture, which shows through; empty if there is none.
    pub picture: &'a str,
}

/// More cells than this are not drawn: the map is coarse by definition.
const MOST: usize = 10_000;

impl Map<'_> {
    /// Columns and rows that are drawn.
    fn grid(&self) -> [usize; 2] {
        let [columns, rows] = self.regions.grid;
        let fine = columns.checked_mul(rows).is_some_and(|n| n <= MOST && n <= self.regions.winner.len());
        if fine { [columns, rows] } else { [0, 0] }
    }

    /// Share of the picture that each method wins.
    pub fn shares(&self) -> Vec<f64> {
        let [columns, rows] = self.grid();
        let cells = self.regions.winner.get(..columns * rows).unwrap_or(&[]);
        let share = |i: usize| cells.iter().filter(|w| **w == i).count() as f64 / cells.len().max(1) as f64;
        (0..self.methods.len()).map(share).collect()
    }

    /// The drawing.
    pub fn draw(&self, size: Size) -> Svg {
        let aspect = if self.aspect.is_finite() { self.aspect.clamp(0.1, 4.0) } else { 1.0 };
        let width = if size == Size::Wide { 400.0 } else { size.width() };
        let height = width * aspect;
        let legend = self.legend_height();
        let mut svg = Svg::new(size, if size == Size::Wide { height.max(legend) } else { height + legend });
        if let Some(uri) = picture(self.picture) {
            svg.image([0.0, 0.0], [width, height], uri);
        }
        let [columns, rows] = self.grid();
        let cell = [width / columns.max(1) as f64, height / rows.max(1) as f64];
        for i in 0..columns * rows {
            self.cell(&mut svg, i, [(i % columns) as f64 * cell[0], (i / columns) as f64 * cell[1]], cell);
        }
        let from = if size == Size::Wide { [width + 24.0, 16.0] } else { [10.0, height + 18.0] };
        self.legend(&mut svg, from);
        svg
    }

    fn cell(&self, svg: &mut Svg, i: usize, corner: [f64; 2], cell: [f64; 2]) {
        let Some((name, look)) = self.regions.winner.get(i).and_then(|w| self.methods.get(*w)) else {
            svg.rect(corner, cell, "nothing");
            return;
        };
        let margin = self.regions.margin.get(i).copied().unwrap_or(1.0);
        let strength = match margin {
            m if m >= 4.0 => "a4",
            m if m >= 2.0 => "a3",
            m if m >= 1.25 => "a2",
            _ => "a1",
        };
        svg.open(look.class, &format!("{name}, by ×{THIN}{}", plain(margin, 2)));
        svg.rect(corner, cell, &format!("cell {strength}"));
        if cell[0].min(cell[1]) > 9.0 {
            svg.marker(look.marker, [corner[0] + cell[0] / 2.0, corner[1] + cell[1] / 2.0], 3.0, look.hollow);
        }
        svg.close();
    }

    fn legend_height(&self) -> f64 {
        20.0 * (self.methods.len() + 5) as f64 + 16.0
    }

    fn legend(&self, svg: &mut Svg, from: [f64; 2]) {
        let mut at = from;
        for ((name, look), share) in self.methods.iter().zip(self.shares()) {
            svg.open(look.class, "");
            svg.marker(look.marker, [at[0], at[1] - 4.0], 4.5, look.hollow);
            svg.close();
            let text = format!("{name}: {}{THIN}% of the picture", plain(100.0 * share, 2));
            svg.text([at[0] + 12.0, at[1]], "", &text);
            at[1] += 20.0;
        }
        at[1] += 8.0;
        svg.text([at[0] - 6.0, at[1]], "dim", "Mean square error of the second best:");
        let steps = [("a1", "less than ×1.25"), ("a2", "×1.25–2"), ("a3", "×2–4"), ("a4", "×4 and more")];
        for (class, text) in steps {
            at[1] += 20.0;
            svg.open("n0", "");
            svg.rect([at[0] - 6.0, at[1] - 11.0], [14.0, 14.0], &format!("cell {class}"));
            svg.close();
            svg.text([at[0] + 14.0, at[1]], "", text);
        }
    }
}
