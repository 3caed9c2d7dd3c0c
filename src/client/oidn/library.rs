//! The library of Open Image Denoise, found at run time: the few functions of its C interface that are needed, behind safe types.
//!
//! The header is that of versions 1.4 to 2.x (`include/OpenImageDenoise/oidn.h`): functions have kept their types, and those that set
//! parameters have changed their names with version 2.

use std::ffi::{CStr, OsStr, c_char, c_int, c_void};
use std::fmt;
use std::mem::ManuallyDrop;
use std::ptr::{NonNull, null_mut};
use std::rc::Rc;
use std::sync::LazyLock;

use libloading::Library;

use crate::image::Grid;

/// Environment variable with the path of the library; if set, no other place is tried.
pub const VARIABLE: &str = "OIDN_LIBRARY";

/// The names by which the system's loader is asked for the library.
pub const NAMES: &[&str] = if cfg!(target_os = "windows") {
    &["OpenImageDenoise.dll"]
} else if cfg!(target_os = "macos") {
    &["libOpenImageDenoise.2.dylib", "libOpenImageDenoise.dylib"]
} else {
    &["libOpenImageDenoise.so.2", "libOpenImageDenoise.so.1", "libOpenImageDenoise.so"]
};

/// An error of Open Image Denoise.
#[derive(Clone, Debug, thiserror::Error)]
pub enum OidnError {
    /// The system's loader does not find the library.
    #[error("Open Image Denoise is not installed: none of {} can be loaded ({reason})", NAMES.join(", "))]
    Missing {
        /// Why the first candidate cannot be loaded.
        reason: String,
    },

    /// The file named by the environment variable is unusable.
    #[error("Open Image Denoise cannot be loaded from {place}: {reason}")]
    Unusable {
        /// Variable and value.
        place: String,
        /// Why the file is unusable.
        reason: String,
    },

    /// There is not enough memory.
    #[error("no memory for Open Image Denoise: choose a smaller --size or close other programs")]
    Memory,

    /// The library failed.
    #[error("Open Image Denoise failed: {0}")]
    Failed(String),
}

/// `OIDN_DEVICE_TYPE_CPU`.
const CPU_DEVICE: c_int = 1;
/// `OIDN_FORMAT_FLOAT3`.
const FLOAT3: c_int = 3;
/// `OIDN_ERROR_OUT_OF_MEMORY`.
const OUT_OF_MEMORY: c_int = 4;

/// The first version that takes features that were filtered before (`cleanAux`).
const FIRST_VERSION: OidnVersion = OidnVersion(1_04_00);

/// A version, as 20303 for 2.3.3.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct OidnVersion(pub u32);

impl fmt::Display for OidnVersion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}.{}.{}", self.0 / 10_000, self.0 / 100 % 100, self.0 % 100)
    }
}

type Handle = *mut c_void;
type NewFilter = unsafe extern "C" fn(Handle, *const c_char) -> Handle;
type SetInt = unsafe extern "C" fn(Handle, *const c_char, c_int);
type SetBool = unsafe extern "C" fn(Handle, *const c_char, bool);
type SetImage =
    unsafe extern "C" fn(Handle, *const c_char, *mut c_void, c_int, usize, usize, usize, usize, usize);
type OfHandle = unsafe extern "C" fn(Handle);

/// The library, loaded for as long as the process runs.
pub struct OidnLibrary {
    path: String,
    version: OidnVersion,
    new_device: unsafe extern "C" fn(c_int) -> Handle,
    commit_device: OfHandle,
    release_device: OfHandle,
    set_device_int: SetInt,
    set_device_bool: SetBool,
    device_int: unsafe extern "C" fn(Handle, *const c_char) -> c_int,
    device_error: unsafe extern "C" fn(Handle, *mut *const c_char) -> c_int,
    new_filter: NewFilter,
    release_filter: OfHandle,
    set_filter_image: SetImage,
    set_filter_bool: SetBool,
    set_filter_int: SetInt,
    commit_filter: OfHandle,
    execute_filter: OfHandle,
    /// Never unloaded, because its threads outlive the filters.
    _library: ManuallyDrop<Library>,
}

static LIBRARY: LazyLock<Result<OidnLibrary, OidnError>> = LazyLock::new(find);

/// The library, searched for on the first call, which takes a few milliseconds.
///
/// # Errors
///
/// If no usable library is found.
pub fn library() -> Result<&'static OidnLibrary, OidnError> {
    LIBRARY.as_ref().map_err(Clone::clone)
}

/// Loads the file named by the environment variable, or else the library found by the system's loader.
fn find() -> Result<OidnLibrary, OidnError> {
    if let Some(path) = std::env::var_os(VARIABLE).filter(|path| !path.is_empty()) {
        let place = || format!("{VARIABLE}={}", path.display());
        return OidnLibrary::load(&path).map_err(|reason| OidnError::Unusable { place: place(), reason });
    }
    let mut missing = None;
    for name in NAMES {
        match OidnLibrary::load(OsStr::new(name)) {
            Ok(library) => return Ok(library),
            Err(reason) => missing = missing.or(Some(reason)),
        }
    }
    Err(OidnError::Missing { reason: missing.unwrap_or_default() })
}

impl OidnLibrary {
    /// Loads a library by path or by name; on failure says why it is unusable.
    fn load(file: &OsStr) -> Result<Self, String> {
        // SAFETY: the file is the one that the user names or installed as Open Image Denoise, whose initialisers have no conditions.
        let library = unsafe { Library::new(file) }.map_err(|error| error.to_string())?;
        let library = ManuallyDrop::new(library);
        let lacking =
            |name: &str| format!("it is no Open Image Denoise, or another version: it has no {name}");
        macro_rules! find {
            ($($field:ident: $name:literal $(or $older:literal)?,)*) => {{
                $(
                    // SAFETY: the type is that of the header, for every version that has a function of this name.
                    let found = unsafe { library.get($name) };
                    $(
                        // SAFETY: as above; this is its name before version 2.
                        let found = found.or_else(|_| unsafe { library.get($older) });
                    )?
                    let $field = *found.map_err(|_| lacking(&String::from_utf8_lossy($name)))?;
                )*
                Self { path: String::new(), version: OidnVersion(0), $($field,)* _library: library }
            }};
        }
        let mut library = find! {
            new_device: b"oidnNewDevice",
            commit_device: b"oidnCommitDevice",
            release_device: b"oidnReleaseDevice",
            set_device_int: b"oidnSetDeviceInt" or b"oidnSetDevice1i",
            set_device_bool: b"oidnSetDeviceBool" or b"oidnSetDevice1b",
            device_int: b"oidnGetDeviceInt" or b"oidnGetDevice1i",
            device_error: b"oidnGetDeviceError",
            new_filter: b"oidnNewFilter",
            release_filter: b"oidnReleaseFilter",
            set_filter_image: b"oidnSetSharedFilterImage",
            set_filter_bool: b"oidnSetFilterBool" or b"oidnSetFilter1b",
            set_filter_int: b"oidnSetFilterInt" or b"oidnSetFilter1i",
            commit_filter: b"oidnCommitFilter",
            execute_filter: b"oidnExecuteFilter",
        };
        // SAFETY: the call has no precondition; null is an error.
        let device = unsafe { (library.new_device)(CPU_DEVICE) };
        if device.is_null() {
            return Err(library.error(device).map_or_else(|| "it opens no CPU device".into(), |e| e.1));
        }
        // SAFETY: the device is open, the name ends with 0, and nothing refers to the device afterwards.
        let version = unsafe {
            let version = (library.device_int)(device, c"version".as_ptr());
            (library.release_device)(device);
            version
        };
        library.version = OidnVersion(u32::try_from(version).unwrap_or(0));
        if library.version < FIRST_VERSION {
            return Err(format!(
                "version {} is too old: {FIRST_VERSION} is the first to do",
                library.version
            ));
        }
        library.path = place_in_memory().unwrap_or_else(|| file.display().to_string());
        Ok(library)
    }

    /// Path of the library; if the system does not report it, the name by which it was found.
    pub fn path(&self) -> &str {
        &self.path
    }

    /// Its version.
    pub fn version(&self) -> OidnVersion {
        self.version
    }

    /// The first error since the last call, with its message. `device` is open, or null for errors without a device.
    fn error(&self, device: Handle) -> Option<(c_int, String)> {
        let mut message = std::ptr::null();
        // SAFETY: null and open devices are allowed, and `message` is there to be written to.
        let code = unsafe { (self.device_error)(device, &raw mut message) };
        if code == 0 {
            return None;
        }
        if message.is_null() {
            return Some((code, format!("error {code}")));
        }
        // SAFETY: a message ends with 0 and stays until the next call for this device on this thread.
        let text = unsafe { CStr::from_ptr(message) };
        Some((code, text.to_string_lossy().into_owned()))
    }
}

/// Path of the mapped file with the library's name.
fn place_in_memory() -> Option<String> {
    let maps = std::fs::read_to_string("/proc/self/maps").ok()?;
    let path =
        maps.lines().find_map(|line| line.find('/').map(|at| &line[at..]).filter(|path| is_library(path)))?;
    Some(path.to_owned())
}

fn is_library(path: &str) -> bool {
    path.rsplit('/').next().is_some_and(|name| name.starts_with("libOpenImageDenoise.so"))
}

/// A CPU device of the library.
pub struct OidnDevice {
    library: &'static OidnLibrary,
    handle: NonNull<c_void>,
}

impl OidnDevice {
    /// Opens a device with this many threads and without core affinity.
    ///
    /// # Errors
    ///
    /// When there is no library, or the CPU does not support it.
    pub fn open(threads: usize) -> Result<Rc<Self>, OidnError> {
        let library = library()?;
        // SAFETY: the call has no precondition; null is an error.
        let handle = NonNull::new(unsafe { (library.new_device)(CPU_DEVICE) });
        let Some(handle) = handle else { return Err(failed(library.error(null_mut()))) };
        let device = Rc::new(Self { library, handle });
        let threads = c_int::try_from(threads).unwrap_or(c_int::MAX);
        // SAFETY: the device is open and the names end with 0.
        unsafe {
            (library.set_device_int)(handle.as_ptr(), c"numThreads".as_ptr(), threads);
            (library.set_device_bool)(handle.as_ptr(), c"setAffinity".as_ptr(), false);
            (library.commit_device)(handle.as_ptr());
        }
        device.check()?;
        Ok(device)
    }

    /// The version of the library.
    pub fn version(&self) -> OidnVersion {
        self.library.version
    }

    fn check(&self) -> Result<(), OidnError> {
        self.library.error(self.handle.as_ptr()).map_or(Ok(()), |error| Err(failed(Some(error))))
    }
}

impl Drop for OidnDevice {
    fn drop(&mut self) {
        // SAFETY: the device was opened by `open`, and whatever else refers to it counts as a user of its own in the library.
        unsafe { (self.library.release_device)(self.handle.as_ptr()) };
    }
}

/// Converts an error of the library.
fn failed(error: Option<(c_int, String)>) -> OidnError {
    match error {
        Some((OUT_OF_MEMORY, _)) => OidnError::Memory,
        error => OidnError::Failed(error.map_or_else(|| "unknown error".into(), |(_, message)| message)),
    }
}

/// Parameters of a filter, by their names in the library.
pub struct FilterParameters<'a> {
    /// Names of the images; the first one is filtered in place.
    pub images: &'a [&'static CStr],
    /// Boolean parameters to set to true.
    pub flags: &'a [&'static CStr],
    /// Value of the parameter `quality`, if supported.
    pub quality: Option<i32>,
}

/// A filter of type `RT` with its own images, for repeated use.
pub struct RtFilter {
    device: Rc<OidnDevice>,
    handle: NonNull<c_void>,
    /// Leaked boxes; the library reads and writes them in `execute`.
    images: Vec<NonNull<[[f32; 3]]>>,
}

impl RtFilter {
    /// A filter for images of `size` pixels.
    pub fn new(
        device: &Rc<OidnDevice>,
        size: [usize; 2],
        parameters: &FilterParameters<'_>,
    ) -> Result<Self, OidnError> {
        let library = device.library;
        // SAFETY: the device is open and the name ends with 0; null is an error.
        let handle = unsafe { (library.new_filter)(device.handle.as_ptr(), c"RT".as_ptr()) };
        let Some(handle) = NonNull::new(handle) else {
            return Err(failed(library.error(device.handle.as_ptr())));
        };
        let mut filter = Self { device: device.clone(), handle, images: Vec::new() };
        for (i, name) in parameters.images.iter().enumerate() {
            let pixels = black(size)?.into_pixels().into_boxed_slice();
            let pixels = NonNull::from(Box::leak(pixels));
            filter.images.push(pixels);
            filter.set_image(name, pixels, size);
            if i == 0 {
                filter.set_image(c"output", pixels, size);
            }
        }
        for flag in parameters.flags {
            // SAFETY: the filter is there and the name ends with 0.
            unsafe { (library.set_filter_bool)(handle.as_ptr(), flag.as_ptr(), true) };
        }
        if let Some(quality) = parameters.quality {
            // SAFETY: as above.
            unsafe { (library.set_filter_int)(handle.as_ptr(), c"quality".as_ptr(), quality) };
        }
        // SAFETY: the filter is there.
        unsafe { (library.commit_filter)(handle.as_ptr()) };
        device.check()?;
        Ok(filter)
    }

    fn set_image(&self, name: &CStr, pixels: NonNull<[[f32; 3]]>, [width, height]: [usize; 2]) {
        let (set, data) = (self.device.library.set_filter_image, pixels.as_ptr().cast::<c_void>());
        // SAFETY: filter and name are as above. The pixels are width · height of three floats without gaps, which lengths of 0 stand for,
        // and `self` keeps them in their place until the filter is released.
        unsafe { set(self.handle.as_ptr(), name.as_ptr(), data, FLOAT3, width, height, 0, 0, 0) };
    }

    /// The pixels of image `i`, row by row.
    pub fn pixels(&self, i: usize) -> &[[f32; 3]] {
        // SAFETY: the box is ours. The library refers to it only in `execute`, which borrows `self` uniquely.
        unsafe { self.images[i].as_ref() }
    }

    /// The pixels of image `i`, row by row.
    pub fn image(&mut self, i: usize) -> &mut [[f32; 3]] {
        // SAFETY: the box is ours. The library refers to it only in `execute`, which borrows `self` uniquely as this does.
        unsafe { self.images[i].as_mut() }
    }

    /// Filters the first image.
    pub fn execute(&mut self) -> Result<(), OidnError> {
        // SAFETY: the filter is committed, its images are there, and nothing refers to them: `self` is borrowed uniquely. The call returns
        // when all is done.
        unsafe { (self.device.library.execute_filter)(self.handle.as_ptr()) };
        self.device.check()
    }
}

impl Drop for RtFilter {
    fn drop(&mut self) {
        // SAFETY: the filter was made by `new`; nothing uses it afterwards.
        unsafe { (self.device.library.release_filter)(self.handle.as_ptr()) };
        for pixels in self.images.drain(..) {
            // SAFETY: it was leaked from a box by `new`, and the only other user was the filter.
            drop(unsafe { Box::from_raw(pixels.as_ptr()) });
        }
    }
}

/// A black image for the library.
fn black([width, height]: [usize; 2]) -> Result<Grid<[f32; 3]>, OidnError> {
    Grid::try_filled(width, height, [0.0; 3]).ok_or(OidnError::Memory)
}
