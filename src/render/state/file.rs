//! File format of a state.
//!
//! | bytes | what |
//! |---|---|
//! | 8 | [`MAGIC`] |
//! | 4 | [`VERSION`], little endian like every number |
//! | 8 | length of the header |
//! | … | the header: [`StateHeader`] as JSON, with the list of sections |
//! | … | the sections, row by row; with two eyes, those of the left one and then those of the right |
//! | 32 | BLAKE3 of everything before |
//!
//! A row of a section holds, channel by channel, the number of the first byte and the number of bytes that any of the row's sums uses,
//! one byte each, and then these bytes of each sum, least significant first. So a row without samples takes two bytes per channel, and
//! a sum six to eight instead of sixteen. The section of the largest samples holds plain floats.

use std::fs::File;
use std::io::{BufReader, ErrorKind, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use miette::{IntoDiagnostic, Report, Result};
use serde::{Deserialize, Serialize};

use crate::client::reference::ExactFilm;
use crate::client::reference::accumulator::ExactTexel;
use crate::client::{Film, FilmCounts};
use crate::image::Grid;
use crate::image::write::AtomicFile;
use crate::math::exact_sum::ExactSum;
use crate::render::state::header::StateHeader;
use crate::stream::{PathCounts, REPLICATES};
use crate::study::largest::KEPT;
use crate::study::{ExactPixel, ExactReplicates};

/// Magic number of the file.
pub const MAGIC: [u8; 8] = *b"\x8bPNTLST\n";

/// Version of the format; later ones are not read.
pub const VERSION: u32 = 2;

/// Version of the format of one eye, which has not changed with the second one.
const VERSION_OF_ONE_EYE: u32 = 1;

/// Longest header, bytes.
const LONGEST_HEADER: u64 = 64 << 20;

/// Bytes of the hash at the end.
const HASH: u64 = 32;

/// A grid of sums.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
enum Section {
    /// Film: camera stream (0) or light stream (1); X, Y, Z, W and Y².
    Film(usize),
    /// Replicate and stream; X, Y, Z and W.
    Replicate(usize, usize),
    /// The largest samples of each tile.
    Largest,
}

/// Header, and list of the sections that follow.
#[derive(Serialize, Deserialize)]
struct Contents {
    #[serde(flatten)]
    about: StateHeader,
    sections: Vec<Section>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    right_sections: Vec<Section>,
}

/// A render in memory that can be written, resumed, and merged with others.
pub struct RenderState {
    pub about: StateHeader,
    /// Sums of the picture, or of the left eye's.
    pub sums: PictureSums,
    /// Sums of the right eye's picture, if there are two.
    pub right_eye: Option<PictureSums>,
}

/// Exact sums of one picture.
pub struct PictureSums {
    pub film: ExactFilm,
    /// `None` if the render is not divided into replicates.
    pub replicates: Option<ExactReplicates>,
}

impl PictureSums {
    /// Empty sums.
    ///
    /// # Errors
    ///
    /// When the film cannot be created.
    fn new(about: &StateHeader, threads: usize) -> Result<Self> {
        let (spec, scale) = (about.run.film, about.identity.luminance_scale);
        let film = ExactFilm::new(spec, threads, scale).into_diagnostic()?;
        let exact = || ExactReplicates::new([spec.width, spec.height], spec.filter.energy(), scale);
        let replicates = about.run.replicated.then(exact);
        Ok(Self { film, replicates })
    }

    fn add_counts(&mut self, counts: FilmCounts, replicates: [PathCounts; REPLICATES]) {
        self.film.add_counts(counts);
        let parts = self.replicates.iter_mut().flat_map(|exact| &mut exact.parts);
        parts.zip(replicates).for_each(|(part, paths)| part.count_paths(paths));
    }

    /// The sums as [`write()`] takes them, once the film has no batch.
    pub fn shared(&self) -> SharedSums<'_> {
        SharedSums { film: &self.film, replicates: self.replicates.as_ref() }
    }
}

/// Exact sums of one picture, to be written.
#[derive(Clone, Copy)]
pub struct SharedSums<'a> {
    /// Must have no batch.
    pub film: &'a ExactFilm,
    pub replicates: Option<&'a ExactReplicates>,
}

impl<'a> SharedSums<'a> {
    /// Sums of the film, by stream.
    fn of_film(self) -> impl Iterator<Item = (Section, &'a Grid<ExactTexel>)> {
        [0, 1].into_iter().filter_map(move |stream| Some((Section::Film(stream), self.film.sums(stream)?)))
    }

    /// Sums of the replicates, by replicate and stream.
    fn of_replicates(self) -> impl Iterator<Item = (Section, &'a Grid<ExactPixel>)> {
        let parts = self.replicates.into_iter().flat_map(|exact| exact.parts.iter().enumerate());
        let streams = parts.flat_map(|(i, part)| part.streams.iter().enumerate().map(move |s| (i, s)));
        streams.filter_map(|(i, (stream, sums))| Some((Section::Replicate(i, stream), sums.as_ref()?)))
    }

    fn sections(self) -> Vec<Section> {
        let film = self.of_film().map(|(section, _)| section);
        let replicates = self.of_replicates().map(|(section, _)| section);
        film.chain(replicates).chain(self.replicates.map(|_| Section::Largest)).collect()
    }
}

impl RenderState {
    /// An empty render.
    ///
    /// # Errors
    ///
    /// When the film cannot be created.
    pub fn new(about: StateHeader, threads: usize) -> Result<Self> {
        let sums = PictureSums::new(&about, threads)?;
        let right_eye = about.run.stereo.map(|_| PictureSums::new(&about, threads)).transpose()?;
        Ok(Self { about, sums, right_eye })
    }

    /// Writes the state to `path`, replacing an existing file.
    pub fn write(&mut self, path: &Path) -> Result<()> {
        for sums in [&mut self.sums].into_iter().chain(&mut self.right_eye) {
            sums.film.flush().into_diagnostic()?;
        }
        write(path, &self.about, self.sums.shared(), self.right_eye.as_ref().map(PictureSums::shared))
    }

    /// Adds a state of the same picture: sums, indices and counts.
    ///
    /// # Errors
    ///
    /// When indices are present in both (nothing is added then), or the file cannot be read.
    pub fn add(&mut self, mut file: StateFile) -> Result<()> {
        let other = &file.about;
        if self.right_eye.is_some() != other.right_eye.is_some() {
            return Err(damaged(
                &file.path,
                "it does not hold the sums of as many eyes as its settings speak of",
            ));
        }
        self.about.indices.merge(&other.indices).map_err(|twice| {
            miette::miette!(
                "{} holds indices {}–{} once more",
                file.path.display(),
                twice.start,
                twice.end - 1
            )
        })?;
        self.about.seconds += other.seconds;
        self.about.rejections.merge(&other.rejections);
        self.sums.add_counts(other.counts, other.replicates);
        if let Some((sums, of_eye)) = self.right_eye.as_mut().zip(other.right_eye.as_ref()) {
            sums.add_counts(of_eye.counts, other.replicates);
        }
        let [sections, right_sections] = std::mem::take(&mut file.sections);
        file.add_sums(&sections, &mut self.sums)?;
        self.right_eye.as_mut().map_or(Ok(()), |sums| file.add_sums(&right_sections, sums))
    }
}

/// The header with present counts.
fn counted(about: &StateHeader, left: SharedSums<'_>, right: Option<SharedSums<'_>>) -> StateHeader {
    let mut about = about.clone();
    about.counts = left.film.counts();
    about.replicates =
        left.replicates.map_or(Default::default(), |exact| exact.parts.each_ref().map(|part| part.paths));
    if let Some((of_eye, right)) = about.right_eye.as_mut().zip(right) {
        of_eye.counts = right.film.counts();
    }
    about
}

/// Writes a state of one picture, or of those of the left and the right eye, to `path`.
pub fn write(
    path: &Path,
    about: &StateHeader,
    left: SharedSums<'_>,
    right: Option<SharedSums<'_>>,
) -> Result<()> {
    let right_sections = right.map(SharedSums::sections).unwrap_or_default();
    let contents = Contents { about: counted(about, left, right), sections: left.sections(), right_sections };
    let version = if right.is_some() { VERSION } else { VERSION_OF_ONE_EYE };
    let json = serde_json::to_vec(&contents).into_diagnostic()?;
    let mut out =
        HashedWriter { file: AtomicFile::create(path).into_diagnostic()?, hash: blake3::Hasher::new() };
    out.append(&MAGIC)?;
    out.append(&version.to_le_bytes())?;
    out.append(&(json.len() as u64).to_le_bytes())?;
    out.append(&json)?;
    out.sums(left)?;
    right.map_or(Ok(()), |right| out.sums(right))?;
    let hash = out.hash.finalize();
    out.file.append(hash.as_bytes()).into_diagnostic()?;
    out.file.commit().into_diagnostic()
}

/// A file writer that hashes its bytes.
struct HashedWriter {
    file: AtomicFile,
    hash: blake3::Hasher,
}

impl HashedWriter {
    fn append(&mut self, bytes: &[u8]) -> Result<()> {
        self.hash.update(bytes);
        self.file.append(bytes).into_diagnostic()
    }

    /// Appends the sections of a picture.
    fn sums(&mut self, sums: SharedSums<'_>) -> Result<()> {
        sums.of_film().try_for_each(|(_, grid)| self.grid(grid))?;
        sums.of_replicates().try_for_each(|(_, grid)| self.grid(grid))?;
        let Some(exact) = sums.replicates else { return Ok(()) };
        self.append(bytemuck::cast_slice(exact.largest.tiles()))
    }

    fn grid<const C: usize>(&mut self, sums: &Grid<[ExactSum; C]>) -> Result<()> {
        let mut packed = Vec::new();
        for y in 0..sums.height() {
            packed.clear();
            pack(sums.row(y), &mut packed);
            self.append(&packed)?;
        }
        Ok(())
    }
}

/// Appends a row in the format described in the module documentation.
fn pack<const C: usize>(row: &[[ExactSum; C]], out: &mut Vec<u8>) {
    for c in 0..C {
        let used = row.iter().fold(0, |used, sums| used | sums[c].to_bits());
        let first = if used == 0 { 0 } else { used.trailing_zeros() / 8 };
        let len = (128 - used.leading_zeros()).div_ceil(8).saturating_sub(first) as usize;
        out.extend([first as u8, len as u8]);
        for sums in row {
            out.extend_from_slice(&(sums[c].to_bits() >> (8 * first)).to_le_bytes()[..len]);
        }
    }
}

/// A state on disk, with its header read and its hash verified.
pub struct StateFile {
    pub path: PathBuf,
    pub about: StateHeader,
    /// Sections of the picture or of the left eye's, and of the right eye's.
    sections: [Vec<Section>; 2],
    input: BufReader<File>,
}

/// Buffer size for reading, bytes.
const BUFFER: usize = 1 << 20;

impl StateFile {
    /// Opens and verifies a file.
    ///
    /// # Errors
    ///
    /// When the file cannot be read, is not a state, has another version, or is damaged.
    pub fn open(path: &Path) -> Result<Self> {
        let name = path.display();
        let unread = |e: std::io::Error| match e.kind() {
            ErrorKind::UnexpectedEof => damaged(path, "it ends too early"),
            _ => miette::miette!("cannot read {name}: {e}"),
        };
        let meta = std::fs::metadata(path).map_err(unread)?;
        if !meta.is_file() {
            return Err(miette::miette!("{name} is no regular file"));
        }
        let mut input = BufReader::with_capacity(BUFFER, File::open(path).map_err(unread)?);
        let mut start = [0; 20];
        let begins = input.read_exact(&mut start).map(|()| start[..8] == MAGIC);
        if !matches!(begins, Ok(true)) {
            return Err(miette::miette!(
                help = "a state is what `render --state` and `shard` write",
                "{name} is not the state of a render"
            ));
        }
        let number = |at: usize, len: usize| {
            start[at..at + len].iter().rev().fold(0u64, |n, byte| n << 8 | u64::from(*byte))
        };
        let (version, length) = (number(8, 4), number(12, 8));
        if !(u64::from(VERSION_OF_ONE_EYE)..=u64::from(VERSION)).contains(&version) {
            return Err(miette::miette!(
                help = "use the version of the program that wrote it, or render again",
                "{name} has version {version} of the format, and this program reads {VERSION_OF_ONE_EYE} to {VERSION}"
            ));
        }
        if length > LONGEST_HEADER || length > meta.len() {
            return Err(damaged(path, "its header is too long"));
        }
        check_hash(&mut input, meta.len())
            .map_err(unread)?
            .then_some(())
            .ok_or_else(|| damaged(path, "its checksum is not that of its bytes"))?;
        input.seek(SeekFrom::Start(20)).map_err(unread)?;
        let mut json = vec![0; length as usize];
        input.read_exact(&mut json).map_err(unread)?;
        let contents: Contents = serde_json::from_slice(&json)
            .map_err(|e| damaged(path, &format!("its header is not understood: {e}")))?;
        let Contents { about, sections, right_sections } = contents;
        Ok(Self { path: path.to_path_buf(), about, sections: [sections, right_sections], input })
    }

    /// Adds the sums of the next sections to others of the same picture.
    fn add_sums(&mut self, sections: &[Section], sums: &mut PictureSums) -> Result<()> {
        let PictureSums { film, replicates } = sums;
        let (path, size) = (self.path.clone(), [self.about.run.film.width, self.about.run.film.height]);
        let size = size.map(|n| n as usize);
        let unread = |e: std::io::Error| -> Report { damaged(&path, &e.to_string()) };
        for section in sections {
            match (*section, &mut *replicates) {
                (Section::Film(stream @ (0 | 1)), _) => {
                    add_grid(&mut self.input, film.sums_mut(stream).into_diagnostic()?).map_err(unread)?;
                }
                (Section::Replicate(part, stream @ (0 | 1)), Some(exact)) => {
                    let sums = exact.parts.get_mut(part).and_then(|part| part.stream(stream, size));
                    let sums =
                        sums.ok_or_else(|| miette::miette!("no memory for the sums of {}", path.display()))?;
                    add_grid(&mut self.input, sums).map_err(unread)?;
                }
                (Section::Largest, Some(exact)) => {
                    for tile in 0..exact.largest.tiles().len() {
                        let mut luminances = [0.0; KEPT];
                        self.input.read_exact(bytemuck::cast_slice_mut(&mut luminances)).map_err(unread)?;
                        exact.largest.merge(tile, luminances);
                    }
                }
                _ => return Err(damaged(&path, "it holds sums that its settings do not speak of")),
            }
        }
        Ok(())
    }
}

/// Adds rows in the format of [`pack`].
fn add_grid<const C: usize>(input: &mut impl Read, sums: &mut Grid<[ExactSum; C]>) -> std::io::Result<()> {
    let mut bytes = Vec::new();
    for y in 0..sums.height() {
        for c in 0..C {
            let mut place = [0; 2];
            input.read_exact(&mut place)?;
            let [first, len] = place.map(usize::from);
            if first + len > 16 {
                return Err(std::io::Error::new(ErrorKind::InvalidData, "a sum is longer than sums can be"));
            }
            if len == 0 {
                continue;
            }
            bytes.resize(len * sums.width(), 0);
            input.read_exact(&mut bytes)?;
            for (sums, part) in sums.row_mut(y).iter_mut().zip(bytes.chunks_exact(len)) {
                let mut whole = [0; 16];
                whole[first..first + len].copy_from_slice(part);
                sums[c].merge(ExactSum::from_bits(u128::from_le_bytes(whole)));
            }
        }
    }
    Ok(())
}

/// Whether the last bytes of a file of `len` bytes are the hash of all others.
fn check_hash(input: &mut BufReader<File>, len: u64) -> std::io::Result<bool> {
    input.rewind()?;
    let mut hash = blake3::Hasher::new();
    hash.update_reader(input.take(len.saturating_sub(HASH)))?;
    let mut written = [0; HASH as usize];
    input.read_exact(&mut written)?;
    Ok(hash.finalize() == blake3::Hash::from(written))
}

fn damaged(path: &Path, how: &str) -> Report {
    miette::miette!(help = "render it again, or leave it out", "{} is damaged: {how}", path.display())
}
