//! File format of a state.
//!
//! | bytes | what |
//! |---|---|
//! | 8 | [`MAGIC`] |
//! | 4 | [`VERSION`], little endian like every number |
//! | 8 | length of the header |
//! | … | the header: [`StateHeader`] as JSON, with the list of sections |
//! | … | the sections, row by row |
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

use crate::client::Film;
use crate::client::reference::ExactFilm;
use crate::image::Grid;
use crate::image::write::AtomicFile;
use crate::math::exact_sum::ExactSum;
use crate::render::state::header::StateHeader;
use crate::study::ExactReplicates;
use crate::study::largest::KEPT;

/// Magic number of the file.
pub const MAGIC: [u8; 8] = *b"\x8bPNTLST\n";

/// Version of the format; no other is read.
pub const VERSION: u32 = 1;

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
}

/// A render in memory that can be written, resumed, and merged with others.
pub struct RenderState {
    pub about: StateHeader,
    pub film: ExactFilm,
    /// `None` if the render is not divided into replicates.
    pub replicates: Option<ExactReplicates>,
}

impl RenderState {
    /// An empty render.
    ///
    /// # Errors
    ///
    /// When the film cannot be created.
    pub fn new(about: StateHeader, threads: usize) -> Result<Self> {
        let (spec, scale) = (about.run.film, about.identity.luminance_scale);
        let film = ExactFilm::new(spec, threads, scale).into_diagnostic()?;
        let exact = || ExactReplicates::new([spec.width, spec.height], spec.filter.energy(), scale);
        let replicates = about.run.replicated.then(exact);
        Ok(Self { about, film, replicates })
    }

    /// Writes the state to `path`, replacing an existing file.
    pub fn write(&mut self, path: &Path) -> Result<()> {
        self.film.flush().into_diagnostic()?;
        write(path, &self.about, &self.film, self.replicates.as_ref())
    }

    /// Adds a state of the same picture: sums, indices and counts.
    ///
    /// # Errors
    ///
    /// When indices are present in both (nothing is added then), or the file cannot be read.
    pub fn add(&mut self, mut file: StateFile) -> Result<()> {
        let other = &file.about;
        self.about.indices.merge(&other.indices).map_err(|twice| {
            miette::miette!(
                "{} holds indices {}–{} once more",
                file.path.display(),
                twice.start,
                twice.end - 1
            )
        })?;
        self.film.add_counts(other.counts);
        self.about.seconds += other.seconds;
        self.about.rejections.merge(&other.rejections);
        if let Some(replicates) = &mut self.replicates {
            for (part, paths) in replicates.parts.iter_mut().zip(other.replicates) {
                part.count_paths(paths);
            }
        }
        file.add_sums(&mut self.film, self.replicates.as_mut())
    }

    /// The header with present counts.
    fn counted(about: &StateHeader, film: &ExactFilm, replicates: Option<&ExactReplicates>) -> StateHeader {
        let mut about = about.clone();
        about.counts = film.counts();
        about.replicates =
            replicates.map_or(Default::default(), |exact| exact.parts.each_ref().map(|part| part.paths));
        about
    }
}

/// Writes a state, whose film must have no batch, to `path`.
pub fn write(
    path: &Path,
    about: &StateHeader,
    film: &ExactFilm,
    replicates: Option<&ExactReplicates>,
) -> Result<()> {
    let films = [0, 1].map(|stream| (Section::Film(stream), film.sums(stream)));
    let films: Vec<_> = films.into_iter().filter_map(|(section, sums)| Some((section, sums?))).collect();
    let mut parts = Vec::new();
    for (i, part) in replicates.iter().flat_map(|exact| exact.parts.iter().enumerate()) {
        let sums = part.streams.iter().enumerate();
        parts.extend(sums.filter_map(|(stream, sums)| Some((Section::Replicate(i, stream), sums.as_ref()?))));
    }
    let mut sections: Vec<Section> = films.iter().map(|(section, _)| *section).collect();
    sections.extend(parts.iter().map(|(section, _)| *section));
    sections.extend(replicates.map(|_| Section::Largest));
    let about = RenderState::counted(about, film, replicates);
    let json = serde_json::to_vec(&Contents { about, sections }).into_diagnostic()?;
    let mut out =
        HashedWriter { file: AtomicFile::create(path).into_diagnostic()?, hash: blake3::Hasher::new() };
    out.append(&MAGIC)?;
    out.append(&VERSION.to_le_bytes())?;
    out.append(&(json.len() as u64).to_le_bytes())?;
    out.append(&json)?;
    films.iter().try_for_each(|(_, sums)| out.grid(sums))?;
    parts.iter().try_for_each(|(_, sums)| out.grid(sums))?;
    if let Some(exact) = replicates {
        out.append(bytemuck::cast_slice(exact.largest.tiles()))?;
    }
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
    sections: Vec<Section>,
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
        if version != u64::from(VERSION) {
            return Err(miette::miette!(
                help = "use the version of the program that wrote it, or render again",
                "{name} has version {version} of the format, and this program reads version {VERSION}"
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
        let Contents { about, sections } = contents;
        Ok(Self { path: path.to_path_buf(), about, sections, input })
    }

    /// Adds the sums to others of the same picture.
    fn add_sums(&mut self, film: &mut ExactFilm, mut replicates: Option<&mut ExactReplicates>) -> Result<()> {
        let (path, size) = (self.path.clone(), [self.about.run.film.width, self.about.run.film.height]);
        let size = size.map(|n| n as usize);
        let unread = |e: std::io::Error| -> Report { damaged(&path, &e.to_string()) };
        for section in self.sections.clone() {
            match (section, &mut replicates) {
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
