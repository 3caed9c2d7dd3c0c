//! The files of a stage: layers, packages (`usdz`) and pictures, all read by the project's own reader of files, which limits and
//! counts them.

use std::cell::{Cell, RefCell};
use std::collections::BTreeMap;
use std::io::{Cursor, Read};
use std::path::{Path, PathBuf};
use std::rc::Rc;

use openusd::ar;
use zip::ZipArchive;

use super::crate_check;
use super::text_check;
use crate::scene::files::SceneFiles;
use crate::scene::limits;

/// Files that were read, and what may still be read.
pub(super) struct StageAssets {
    files: SceneFiles,
    packages: RefCell<BTreeMap<PathBuf, Option<Rc<UsdzPackage>>>>,
    /// Bytes of all layers so far, each counted each time.
    read: Cell<u64>,
    default: ar::DefaultResolver,
}

/// A package: an archive of layers and pictures.
struct UsdzPackage {
    archive: RefCell<ZipArchive<Cursor<Vec<u8>>>>,
    names: Vec<String>,
    /// Bytes that may still be unpacked: it could be a few bytes that stand for many.
    left: Cell<u64>,
}

impl UsdzPackage {
    fn open(bytes: Vec<u8>) -> Result<Self, String> {
        let left = limits::MESH_INFLATED_FREE + limits::MESH_INFLATION * bytes.len() as u64;
        let archive =
            ZipArchive::new(Cursor::new(bytes)).map_err(|e| format!("it is no package of USD: {e}"))?;
        let names = (0..archive.len()).filter_map(|i| archive.name_for_index(i).map(str::to_owned)).collect();
        Ok(Self { archive: RefCell::new(archive), names, left: Cell::new(left) })
    }

    fn entry(&self, name: &str) -> Result<Vec<u8>, String> {
        let mut archive = self.archive.borrow_mut();
        let entry = archive.by_name(name).map_err(|e| format!("{e}"))?;
        let mut bytes = Vec::new();
        entry.take(self.left.get() + 1).read_to_end(&mut bytes).map_err(|e| e.to_string())?;
        match self.left.get().checked_sub(bytes.len() as u64) {
            Some(left) => self.left.set(left),
            None => return Err("it unpacks to far more than its size".to_owned()),
        }
        Ok(bytes)
    }
}

/// Whether the name of a file in a package is that of a layer.
fn is_layer(name: &str) -> bool {
    let ending = Path::new(name).extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase);
    matches!(ending.as_deref(), Some("usd" | "usda" | "usdc"))
}

/// A path within a package as that of the package and the rest.
fn split(path: &str) -> Option<(String, String)> {
    ar::is_package_relative_path(path).then(|| ar::split_package_relative_path_outer(path)).flatten()
}

impl StageAssets {
    /// Those of `files`.
    pub(super) fn new(files: SceneFiles) -> Self {
        Self { files, packages: RefCell::default(), read: Cell::new(0), default: ar::DefaultResolver::new() }
    }

    /// Bytes of all files so far.
    pub(super) fn bytes_read(&self) -> u64 {
        self.read.get()
    }

    /// The bytes of a file on the disk or in a package.
    ///
    /// # Errors
    ///
    /// Why there are none.
    pub(super) fn bytes(&self, path: &str) -> Result<Vec<u8>, String> {
        if let Some((package, inner)) = split(path) {
            let package = self.package(Path::new(&package))?;
            let bytes = package.entry(&inner)?;
            self.read.set(self.read.get() + bytes.len() as u64);
            return Ok(bytes);
        }
        let left = limits::TOTAL_MESH_BYTES.saturating_sub(self.read.get());
        let bytes =
            self.files.read(Path::new(path), limits::MESH_BYTES.min(left)).map_err(|e| e.to_string())?;
        self.read.set(self.read.get() + bytes.len() as u64);
        Ok(bytes.into_owned())
    }

    fn package(&self, path: &Path) -> Result<Rc<UsdzPackage>, String> {
        if let Some(known) = self.packages.borrow().get(path) {
            return known.clone().ok_or_else(|| "it is no package of USD".to_owned());
        }
        let package = self.bytes(&path.to_string_lossy()).and_then(UsdzPackage::open).map(Rc::new);
        self.packages.borrow_mut().insert(path.to_owned(), package.as_ref().ok().cloned());
        package
    }

    /// The path of a layer that another one names.
    pub(super) fn named_by(&self, name: &str, layer: &str) -> String {
        use ar::Resolver as _;
        self.default.create_identifier(&name.replace('\\', "/"), Some(&ar::ResolvedPath::new(layer)))
    }

    /// The path of the layer that a file is opened as: in a package that of its first layer.
    pub(super) fn root_layer(&self, path: &Path) -> Result<String, String> {
        let name = path.canonicalize().unwrap_or_else(|_| path.to_owned());
        let name = name.to_string_lossy().into_owned();
        if !name.to_ascii_lowercase().ends_with(".usdz") {
            return Ok(name);
        }
        let package = self.package(Path::new(&name))?;
        let first = package.names.iter().find(|name| is_layer(name));
        let first = first.ok_or("it has no layer: no `.usd`, `.usda` or `.usdc` is in it")?;
        Ok(ar::join_package_relative_path(&name, first))
    }

    /// The bytes of a layer, checked: the crate takes numbers of files as they are.
    pub(super) fn layer(&self, path: &str) -> Result<Vec<u8>, String> {
        let bytes = self.bytes(path)?;
        if bytes.starts_with(crate_check::MAGIC) {
            crate_check::check(&bytes)?;
        } else if !bytes.starts_with(b"PK") {
            return text_check::checked(bytes);
        }
        Ok(bytes)
    }
}

/// Finds and opens files for the crate.
pub(super) struct StageResolver(pub(super) Rc<StageAssets>);

impl ar::Resolver for StageResolver {
    fn create_identifier(&self, asset_path: &str, anchor: Option<&ar::ResolvedPath>) -> String {
        self.0.default.create_identifier(&asset_path.replace('\\', "/"), anchor)
    }

    fn resolve(&self, asset_path: &str) -> Option<ar::ResolvedPath> {
        if let Some((package, inner)) = split(asset_path) {
            let package_bytes = self.0.package(Path::new(&package)).ok()?;
            return package_bytes.names.contains(&inner).then(|| ar::ResolvedPath::new(asset_path));
        }
        let path = Path::new(asset_path);
        (!asset_path.is_empty() && path.is_file()).then(|| ar::ResolvedPath::new(path))
    }

    fn resolve_for_new_asset(&self, _: &str) -> Option<ar::ResolvedPath> {
        None
    }

    fn open_asset(&self, resolved_path: &ar::ResolvedPath) -> std::io::Result<Box<dyn ar::Asset>> {
        let bytes = self.0.layer(&resolved_path.to_string_lossy()).map_err(std::io::Error::other)?;
        Ok(Box::new(Cursor::new(bytes)))
    }
}
