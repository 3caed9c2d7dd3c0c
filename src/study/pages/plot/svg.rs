//! A writer of SVG: what is written is well-formed whatever numbers and names come in.

use crate::study::pages::escape::xml;

/// Colours, lines and text of every plot. A page includes it once, a standalone picture has it inside.
pub const STYLE: &str = include_str!("plot.css");

/// For how wide a place a plot is drawn. A page holds the wide and the narrow one and shows that which fits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Size {
    /// 720 units, for 720 pixels.
    Wide,
    /// 340 units, for telephones.
    Narrow,
    /// 240 units, for lists.
    Thumb,
}

impl Size {
    /// Width of the drawing.
    pub fn width(self) -> f64 {
        match self {
            Self::Wide => 720.0,
            Self::Narrow => 340.0,
            Self::Thumb => 240.0,
        }
    }

    /// Width of a character of the plots' text, on average.
    pub fn character(self) -> f64 {
        if self == Self::Wide { 7.1 } else { 6.3 }
    }
}

/// A drawing that is being written.
pub struct Svg {
    size: Size,
    height: f64,
    body: String,
}

impl Svg {
    /// An empty drawing.
    pub fn new(size: Size, height: f64) -> Self {
        Self { size, height, body: String::new() }
    }

    /// A straight line.
    pub fn line(&mut self, from: [f64; 2], to: [f64; 2], class: &str) {
        let [x1, y1, x2, y2] = [from[0], from[1], to[0], to[1]].map(number);
        self.body += &format!("<line x1=\"{x1}\" y1=\"{y1}\" x2=\"{x2}\" y2=\"{y2}\" class=\"{class}\"/>");
    }

    /// A chain of lines, or the area that it goes round.
    pub fn path(&mut self, points: &[[f64; 2]], class: &str) {
        if points.is_empty() {
            return;
        }
        let steps: Vec<String> =
            points.iter().map(|[x, y]| format!("{} {}", number(*x), number(*y))).collect();
        self.body += &format!("<path d=\"M{}\" class=\"{class}\"/>", steps.join("L"));
    }

    /// A rectangle.
    pub fn rect(&mut self, corner: [f64; 2], size: [f64; 2], class: &str) {
        let [x, y, w, h] = [corner[0], corner[1], size[0].max(0.0), size[1].max(0.0)].map(number);
        self.body += &format!("<rect x=\"{x}\" y=\"{y}\" width=\"{w}\" height=\"{h}\" class=\"{class}\"/>");
    }

    /// Text; class `e` ends there, `c` is centred there.
    pub fn text(&mut self, at: [f64; 2], class: &str, text: &str) {
        let [x, y] = at.map(number);
        self.body += &format!("<text x=\"{x}\" y=\"{y}\" class=\"{class}\">{}</text>", xml(text));
    }

    /// A picture that is in the page itself.
    pub fn image(&mut self, corner: [f64; 2], size: [f64; 2], uri: &str) {
        let [x, y, w, h] = [corner[0], corner[1], size[0], size[1]].map(number);
        self.body += &format!(
            "<image x=\"{x}\" y=\"{y}\" width=\"{w}\" height=\"{h}\" preserveAspectRatio=\"none\" href=\"{}\"/>",
            xml(uri)
        );
    }

    /// Opens a group; what stands in `note` is shown by a pointer that rests on it.
    pub fn open(&mut self, class: &str, note: &str) {
        self.body += &format!("<g class=\"{class}\">");
        if !note.is_empty() {
            self.body += &format!("<title>{}</title>", xml(note));
        }
    }

    /// Closes a group.
    pub fn close(&mut self) {
        self.body += "</g>";
    }

    /// One of the markers that tell methods apart without colour.
    pub fn marker(&mut self, shape: usize, at: [f64; 2], r: f64, hollow: bool) {
        let class = if hollow { "hollow" } else { "solid" };
        let around =
            |points: &[[f64; 2]]| points.iter().map(|p| [at[0] + r * p[0], at[1] + r * p[1]]).collect();
        let corners: Vec<[f64; 2]> = match shape % 8 {
            0 => {
                let [x, y, r] = [at[0], at[1], r].map(number);
                self.body += &format!("<circle cx=\"{x}\" cy=\"{y}\" r=\"{r}\" class=\"{class}\"/>");
                return;
            }
            1 => around(&[[-0.9, -0.9], [0.9, -0.9], [0.9, 0.9], [-0.9, 0.9]]),
            2 => around(&[[0.0, -1.2], [1.1, 0.8], [-1.1, 0.8]]),
            3 => around(&[[0.0, -1.3], [1.3, 0.0], [0.0, 1.3], [-1.3, 0.0]]),
            4 => around(&[[0.0, 1.2], [1.1, -0.8], [-1.1, -0.8]]),
            5 => around(&[[-0.5, -1.2], [0.5, -1.2], [0.5, 1.2], [-0.5, 1.2]]),
            6 => around(&[[-1.2, -0.5], [1.2, -0.5], [1.2, 0.5], [-1.2, 0.5]]),
            _ => around(&[[0.0, -1.2], [1.1, -0.4], [0.7, 1.0], [-0.7, 1.0], [-1.1, -0.4]]),
        };
        let first = corners.first().copied().unwrap_or(at);
        self.path(&[corners, vec![first]].concat(), class);
    }

    /// The drawing, for a page that has [`STYLE`].
    pub fn inline(self, label: &str) -> String {
        let (w, h) = (number(self.size.width()), number(self.height));
        let class = format!("plot {}", if self.size == Size::Wide { "big" } else { "small" });
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"{class}\" viewBox=\"0 0 {w} {h}\" role=\"img\" \
             aria-label=\"{}\">{}</svg>",
            xml(label),
            self.body
        )
    }

    /// The drawing as a file of its own: with its style, on paper that is light or dark as the reader has it.
    pub fn standalone(self, label: &str) -> String {
        let (w, h) = (number(self.size.width()), number(self.height));
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"plot big\" viewBox=\"0 0 {w} {h}\" width=\"{w}\" \
             height=\"{h}\" role=\"img\"><title>{}</title><style>{STYLE}</style>\
             <rect width=\"{w}\" height=\"{h}\" rx=\"6\" class=\"paper\"/>{}</svg>\n",
            xml(label),
            self.body
        )
    }
}

/// A coordinate: one decimal, and never what SVG does not know.
fn number(x: f64) -> String {
    let x = if x.is_finite() { x.clamp(-1e5, 1e5) } else { 0.0 };
    let text = format!("{x:.1}");
    text.strip_suffix(".0").map_or(text.clone(), str::to_string)
}
