//! A mesh file as messages name it, and what every format does once the numbers are read: faults are dropped and counted,
//! normals are made or mended.

use std::sync::Arc;

use glam::{DMat3, Vec2};

use super::options::MeshOptions;
use super::{check, normals};
use crate::scene::desc::Mesh;
use crate::scene::diagnostic::{Finding, FindingKind, LineAt, SceneError, SceneWarning};
use crate::scene::leftovers::Leftovers;

/// The texture coordinates of a vertex of which the file has none, beside others that have some.
pub(crate) const MISSING_UV: Vec2 = Vec2::INFINITY;

/// A kind of fault: how often, and the first line it was in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Count {
    pub(super) times: usize,
    pub(super) first_line: usize,
}

impl Count {
    /// One more, at a line (from 1).
    pub(super) fn add(&mut self, line: impl FnOnce() -> usize) {
        if self.times == 0 {
            self.first_line = line();
        }
        self.times += 1;
    }

    /// Those of later lines, too.
    pub(super) fn merge(&mut self, later: Count) {
        if self.times == 0 {
            self.first_line = later.first_line;
        }
        self.times += later.times;
    }
}

/// A mesh, with what was wrong with its file.
#[derive(Clone, Debug)]
pub struct MeshRead {
    /// Size of the file.
    pub bytes: usize,
    /// The mesh.
    pub mesh: Arc<Mesh>,
    /// Why it has no triangle, if it has none.
    pub nothing: Option<SceneError>,
    /// One warning for each kind of fault that was dropped or mended, at its first place.
    pub warnings: Vec<SceneWarning>,
}

/// A mesh as the reader of a format returns it: indices are in range, everything else is as in the file.
pub(super) struct RawMesh<'a> {
    pub(super) mesh: Mesh,
    /// Numbers of dropped elements, each with the words that follow the number.
    pub(super) dropped: Vec<(Count, &'static str)>,
    /// Data that was read and is not used.
    pub(super) left: Leftovers,
    pub(super) warnings: Vec<SceneWarning>,
    /// The line of a triangle, by its index.
    pub(super) line_of: Box<dyn Fn(usize) -> usize + 'a>,
    /// Advice for a file without triangles.
    pub(super) advice: &'static str,
}

/// A file for messages.
#[derive(Clone, Copy)]
pub(super) struct MeshFile<'a> {
    pub(super) name: &'a str,
    pub(super) bytes: &'a [u8],
    /// The text of the file, of which messages show lines.
    pub(super) text: &'a [u8],
}

impl MeshFile<'_> {
    pub(super) fn finding(&self, line: usize, message: impl Into<String>) -> Finding {
        self.finding_of(FindingKind::Mesh, line, message)
    }

    pub(super) fn finding_of(&self, kind: FindingKind, line: usize, message: impl Into<String>) -> Finding {
        let text = self.text.split(|b| *b == b'\n').nth(line.saturating_sub(1)).unwrap_or_default();
        let text = String::from_utf8_lossy(&text[..text.len().min(1000)]);
        let text = text.trim_end();
        Finding::new(
            kind,
            LineAt { file: self.name, text, line: line.max(1), column: 1, range: (0, text.len()) },
            message,
        )
    }

    /// A warning for each kind of fault.
    pub(super) fn told(&self, dropped: Vec<(Count, &'static str)>) -> Vec<SceneWarning> {
        let there = dropped.into_iter().filter(|(count, _)| count.times > 0);
        let told = there.map(|(count, what)| {
            let found = self.finding(count.first_line, format!("{} {what}", count.times));
            found.label("the first").warning()
        });
        told.collect()
    }

    /// One note about all that is not used.
    pub(super) fn left_over(&self, left: &Leftovers) -> Option<SceneWarning> {
        left.note().map(|(note, line)| self.finding(line, note).label("the first").advice())
    }

    /// Checks what was read, tells what was dropped or mended, and gives the mesh its normals.
    pub(super) fn finish(&self, raw: RawMesh<'_>, options: &MeshOptions) -> Result<MeshRead, SceneError> {
        let RawMesh { mut mesh, mut dropped, left, mut warnings, line_of, advice } = raw;
        let repairs = check::repair(&mut mesh, line_of);
        dropped.extend([
            (repairs.not_finite, "triangles have a vertex that is not a finite number: dropped"),
            (repairs.flat, "triangles have no area: dropped"),
        ]);
        let nothing = mesh.triangles.is_empty().then(|| {
            let line = dropped.iter().map(|(count, _)| count.first_line).max().unwrap_or(1);
            self.finding(line, "this mesh has no triangle that can be traced").help(advice).error()
        });
        warnings.extend(self.told(dropped));
        warnings.extend(self.left_over(&left));
        let bad =
            [(repairs.bad_uvs, "texture coordinates"), (repairs.bad_attributes, "numbers of attributes")];
        for (count, what) in bad.into_iter().filter(|(count, _)| *count > 0) {
            warnings.push(self.finding(1, format!("{count} {what} are not finite: set to 0")).warning());
        }
        let world = options.world.map_or(DMat3::IDENTITY, |m| DMat3::from_cols_array(&m.map(f64::from_bits)));
        let mut mended = normals::Mended::default();
        if options.face_normals {
            mesh.normals = Vec::new();
        } else if mesh.normals.is_empty() {
            mesh.normals = normals::from_faces(&mesh, &world);
        } else {
            mended = normals::mend(&mut mesh, &world);
        }
        if mended.bad > 0 {
            let message = format!("{} normals have no direction: made from the faces", mended.bad);
            warnings.push(self.finding(1, message).warning());
        }
        let missing = [
            (repairs.missing_uvs, "texture coordinates: 0 0 is used"),
            (mended.missing, "normals: made from the faces"),
        ];
        let missing = missing.iter().filter(|(count, _)| *count > 0);
        let missing: Vec<String> = missing.map(|(count, what)| format!("{count} have no {what}")).collect();
        if !missing.is_empty() {
            let message = format!("of {} vertices {}", mesh.positions.len(), missing.join("; "));
            warnings.push(self.finding(1, message).label("in this file").warning());
        }
        Ok(MeshRead { bytes: self.bytes.len(), mesh: Arc::new(mesh), nothing, warnings })
    }
}
