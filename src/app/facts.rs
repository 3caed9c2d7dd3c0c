//! What a run is made of: with these a picture can be made again, so they stand in its file.

use std::path::PathBuf;

use crate::client::{FilmSpec, Reconstruction, Settings, SplatFilter};
use crate::image::Attribute;
use crate::scene::desc::IntegratorKind;

/// Everything that decides the sums of a film, besides the number of paths.
#[derive(Clone, Debug)]
pub struct RunFacts {
    /// The scene file.
    pub scene: PathBuf,
    /// `-D` values.
    pub defines: Vec<(String, String)>,
    /// Size, filter, variance form.
    pub spec: FilmSpec,
    /// Longest path.
    pub max_depth: Option<u32>,
    /// Where roulette begins.
    pub rr_depth: u32,
    /// Lights are not seen directly.
    pub hide_emitters: bool,
    /// Light transport method.
    pub integrator: IntegratorKind,
    /// Samples per pixel where neither a count nor a time is given.
    pub spp: u64,
    /// Seed.
    pub seed: u32,
    /// In index order.
    pub deterministic: bool,
    /// Where it was rasterised.
    pub device: String,
}

impl RunFacts {
    /// Attributes for the picture's file; none depends on time or on the number of threads.
    pub fn attributes(&self, camera_paths: u64) -> Vec<(String, Attribute)> {
        let text = |name: &str, value: String| (name.to_string(), Attribute::Text(value));
        vec![
            text("renderer", format!("pointillist {}", env!("CARGO_PKG_VERSION"))),
            text("scene", self.scene.display().to_string()),
            text("device", self.device.clone()),
            text(
                "integrator",
                match self.integrator {
                    IntegratorKind::Path => "path".to_string(),
                },
            ),
            text("command", self.command(camera_paths)),
        ]
    }

    /// The command line that makes the same sums again.
    fn command(&self, camera_paths: u64) -> String {
        let mut command = format!("pointillist render {}", quoted(&self.scene.display().to_string()));
        for (name, value) in &self.defines {
            command += &format!(" -D {}", quoted(&format!("{name}={value}")));
        }
        let depth = self.max_depth.map_or("-1".to_string(), |d| d.to_string());
        let filter = match self.spec.filter {
            SplatFilter::Gaussian => "gaussian",
            SplatFilter::Tent => "tent",
            SplatFilter::Box => "box",
        };
        command += &format!(
            " --size {}x{} --samples {camera_paths} --seed {} --max-depth {depth} --filter {filter}",
            self.spec.width, self.spec.height, self.seed
        );
        if self.deterministic {
            command += " --deterministic";
        }
        command
    }
}

/// The display options of a picture as they stand on the command line.
pub fn display_options(s: &Settings) -> String {
    let kind = match s.reconstruction {
        Reconstruction::Gaussian => "gaussian",
        Reconstruction::CatmullRom => "catmull-rom",
        Reconstruction::Mipmap => "mipmap",
        Reconstruction::None => "none",
    };
    format!(
        "--reconstruct {kind} --vm {} --exposure {} --contrast {} --gamma {} --profile {}",
        s.vm, s.exposure, s.contrast, s.gamma, s.profile.name
    )
}

/// `text` for a shell: in single quotes unless it is plain.
fn quoted(text: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "-_./=+,:@%".contains(c);
    if !text.is_empty() && text.chars().all(plain) {
        return text.to_string();
    }
    format!("'{}'", text.replace('\'', r"'\''"))
}

#[cfg(test)]
mod tests {
    use super::quoted;

    #[test]
    fn only_what_must_be_is_quoted() {
        assert_eq!(quoted("scenes/cornell.xml"), "scenes/cornell.xml");
        assert_eq!(quoted("a b"), "'a b'");
        assert_eq!(quoted("it's"), r"'it'\''s'");
    }
}
