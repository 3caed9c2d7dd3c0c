//! Embree 3 as a yardstick, by hand: the few functions needed, from the library as the system installed it.
//!
//! Structures and constants after rtcore_ray.h, rtcore_common.h, rtcore_scene.h and rtcore_geometry.h of Embree 3.13.

use std::ffi::{c_char, c_int, c_uint, c_void};
use std::mem::ManuallyDrop;
use std::sync::Arc;
use std::sync::atomic::{AtomicIsize, Ordering};
use std::time::Instant;

use glam::Vec3;
use libloading::Library;
use pointillist::tracer::accel::Ray;

use super::contest::Contestant;

/// `RTCRay` as Embree reads and writes it: after a shadow ray that hits, `tfar` is minus infinity.
#[repr(C, align(16))]
#[derive(Clone, Copy)]
struct RtcRay {
    origin: [f32; 3],
    tnear: f32,
    direction: [f32; 3],
    time: f32,
    tfar: f32,
    mask: u32,
    id: u32,
    flags: u32,
}

impl RtcRay {
    #[inline(always)]
    fn of(ray: &Ray) -> Self {
        let [origin, direction] = [ray.origin.to_array(), ray.direction.to_array()];
        Self { origin, tnear: 0.0, direction, time: 0.0, tfar: ray.t_max, mask: u32::MAX, id: 0, flags: 0 }
    }
}

/// `RTCHit`; a miss leaves `geometry` at [`NONE`].
#[repr(C, align(16))]
#[derive(Clone, Copy)]
struct RtcHit {
    normal: [f32; 3],
    uv: [f32; 2],
    primitive: u32,
    geometry: u32,
    instance: u32,
}

#[repr(C)]
struct RtcRayHit {
    ray: RtcRay,
    hit: RtcHit,
}

/// `RTCIntersectContext`; all zero but the instance is what `rtcInitIntersectContext` makes.
#[repr(C)]
struct RtcContext {
    flags: c_int,
    filter: *const c_void,
    instance: c_uint,
}

const _: () =
    assert!(size_of::<RtcRay>() == 48 && size_of::<RtcRayHit>() == 80 && size_of::<RtcContext>() == 24);

/// `RTC_INVALID_GEOMETRY_ID`.
const NONE: u32 = u32::MAX;

type Handle = *mut c_void;
type Watcher = extern "C" fn(*mut c_void, isize, bool) -> bool;

/// The functions used, found once.
struct Functions {
    new_device: unsafe extern "C" fn(*const c_char) -> Handle,
    release_device: unsafe extern "C" fn(Handle),
    device_property: unsafe extern "C" fn(Handle, c_int) -> isize,
    device_error: unsafe extern "C" fn(Handle) -> c_int,
    watch_memory: unsafe extern "C" fn(Handle, Watcher, *mut c_void),
    new_scene: unsafe extern "C" fn(Handle) -> Handle,
    release_scene: unsafe extern "C" fn(Handle),
    scene_flags: unsafe extern "C" fn(Handle, c_int),
    build_quality: unsafe extern "C" fn(Handle, c_int),
    commit_scene: unsafe extern "C" fn(Handle),
    new_geometry: unsafe extern "C" fn(Handle, c_int) -> Handle,
    new_buffer: unsafe extern "C" fn(Handle, c_int, c_uint, c_int, usize, usize) -> *mut c_void,
    commit_geometry: unsafe extern "C" fn(Handle),
    attach: unsafe extern "C" fn(Handle, Handle) -> c_uint,
    release_geometry: unsafe extern "C" fn(Handle),
    intersect: unsafe extern "C" fn(Handle, *mut RtcContext, *mut RtcRayHit),
    occluded: unsafe extern "C" fn(Handle, *mut RtcContext, *mut RtcRay),
    /// Keeps the functions where they are; never dropped, for Embree's threads may outlive its devices.
    _library: ManuallyDrop<Library>,
}

/// The library and a device of its.
pub struct Device {
    functions: Functions,
    device: Handle,
    /// Bytes the device holds now; told by Embree.
    bytes: AtomicIsize,
}

// SAFETY: Embree's device may be used from any thread, and its functions are not tied to the thread that found them.
unsafe impl Send for Device {}
// SAFETY: as above; concurrent calls on one device are allowed by Embree's manual ("thread safety" of the API).
unsafe impl Sync for Device {}

extern "C" fn count(device: *mut c_void, bytes: isize, _: bool) -> bool {
    // SAFETY: `watch_memory` was given a pointer to a counter that lives as long as its device.
    unsafe { &*device.cast::<AtomicIsize>() }.fetch_add(bytes, Ordering::Relaxed);
    true
}

impl Device {
    /// Loads the library and opens a device with all threads; an error is one line for the user.
    pub fn open() -> Result<Arc<Self>, String> {
        let functions = Functions::load().map_err(|e| {
            format!(
                "Embree is left out: {e}. It comes by apt-get install libembree3-3 (libembree-dev has it too)"
            )
        })?;
        // SAFETY: a null configuration asks for the defaults.
        let device = unsafe { (functions.new_device)(std::ptr::null()) };
        if device.is_null() {
            return Err("Embree is left out: it opens no device on this processor".into());
        }
        let device = Arc::new(Self { functions, device, bytes: AtomicIsize::new(0) });
        // SAFETY: the counter lives in the Arc beside the device and is not moved; Drop releases the device first.
        unsafe {
            (device.functions.watch_memory)(device.device, count, (&raw const device.bytes).cast_mut().cast())
        };
        Ok(device)
    }

    /// Its version as 31305 for 3.13.5.
    pub fn version(&self) -> isize {
        // SAFETY: the device is open; 0 is RTC_DEVICE_PROPERTY_VERSION.
        unsafe { (self.functions.device_property)(self.device, 0) }
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        // SAFETY: the device was opened by new_device and its scenes hold it by Arc: none is left.
        unsafe { (self.functions.release_device)(self.device) };
    }
}

impl Functions {
    fn load() -> Result<Self, libloading::Error> {
        // SAFETY: the library is Embree 3, whose initialisers have no conditions of their own.
        let library = ManuallyDrop::new(unsafe { Library::new("libembree3.so.3") }?);
        macro_rules! find {
            ($($field:ident $name:literal),* $(,)?) => {
                // SAFETY: the types are those of the headers of Embree 3 (C linkage, default alignment), which keep
                // their meaning for the whole of major version 3.
                unsafe { Self { $($field: *library.get($name)?,)* _library: library } }
            };
        }
        Ok(find! {
            new_device b"rtcNewDevice\0",
            release_device b"rtcReleaseDevice\0",
            device_property b"rtcGetDeviceProperty\0",
            device_error b"rtcGetDeviceError\0",
            watch_memory b"rtcSetDeviceMemoryMonitorFunction\0",
            new_scene b"rtcNewScene\0",
            release_scene b"rtcReleaseScene\0",
            scene_flags b"rtcSetSceneFlags\0",
            build_quality b"rtcSetSceneBuildQuality\0",
            commit_scene b"rtcCommitScene\0",
            new_geometry b"rtcNewGeometry\0",
            new_buffer b"rtcSetNewGeometryBuffer\0",
            commit_geometry b"rtcCommitGeometry\0",
            attach b"rtcAttachGeometry\0",
            release_geometry b"rtcReleaseGeometry\0",
            intersect b"rtcIntersect1\0",
            occluded b"rtcOccluded1\0",
        })
    }
}

/// How a scene is built.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Mode {
    /// As Embree does unasked: medium quality, not watertight.
    Default,
    /// Watertight.
    Robust,
    /// The best tree it can build, not watertight.
    High,
}

/// A committed scene of one mesh.
pub struct Scene {
    device: Arc<Device>,
    scene: Handle,
    mode: Mode,
    /// What the commit added, without the corners and indices given.
    bytes: usize,
    /// Of the commit.
    pub seconds: f64,
}

// SAFETY: a committed scene is read only; Embree allows tracing and releasing it from any thread.
unsafe impl Send for Scene {}
// SAFETY: as above; rtcIntersect1 and rtcOccluded1 may run on many threads at once.
unsafe impl Sync for Scene {}

impl Scene {
    /// Builds the tree of a mesh, by all threads.
    pub fn new(
        device: &Arc<Device>,
        vertices: &[Vec3],
        faces: &[[u32; 3]],
        mode: Mode,
    ) -> Result<Self, String> {
        let f = &device.functions;
        // SAFETY: handles are those the calls before gave; each buffer is filled with as many items as it was asked for
        // with (12 bytes each, which is the size of Vec3 and of three u32). Constants: RTC_SCENE_FLAG_ROBUST 4,
        // RTC_BUILD_QUALITY_MEDIUM 1 and HIGH 2, RTC_GEOMETRY_TYPE_TRIANGLE 0, RTC_BUFFER_TYPE_INDEX 0 and VERTEX 1,
        // RTC_FORMAT_UINT3 0x5003, RTC_FORMAT_FLOAT3 0x9003.
        unsafe {
            let scene = (f.new_scene)(device.device);
            (f.scene_flags)(scene, if mode == Mode::Robust { 4 } else { 0 });
            (f.build_quality)(scene, if mode == Mode::High { 2 } else { 1 });
            let geometry = (f.new_geometry)(device.device, 0);
            let corners: *mut Vec3 = (f.new_buffer)(geometry, 1, 0, 0x9003, 12, vertices.len()).cast();
            let indices: *mut [u32; 3] = (f.new_buffer)(geometry, 0, 0, 0x5003, 12, faces.len()).cast();
            if corners.is_null() || indices.is_null() {
                return Err(format!("Embree gives no memory for {} triangles", faces.len()));
            }
            corners.copy_from_nonoverlapping(vertices.as_ptr(), vertices.len());
            indices.copy_from_nonoverlapping(faces.as_ptr(), faces.len());
            let (start, before) = (Instant::now(), device.bytes.load(Ordering::Relaxed));
            (f.commit_geometry)(geometry);
            (f.attach)(scene, geometry);
            (f.release_geometry)(geometry);
            (f.commit_scene)(scene);
            let seconds = start.elapsed().as_secs_f64();
            let bytes = (device.bytes.load(Ordering::Relaxed) - before).max(0) as usize;
            match (f.device_error)(device.device) {
                0 => Ok(Self { device: device.clone(), scene, mode, bytes, seconds }),
                code => Err(format!("Embree refuses the mesh: error {code}")),
            }
        }
    }
}

impl Drop for Scene {
    fn drop(&mut self) {
        // SAFETY: the scene was made by new_scene and is released once.
        unsafe { (self.device.functions.release_scene)(self.scene) };
    }
}

fn context() -> RtcContext {
    RtcContext { flags: 0, filter: std::ptr::null(), instance: NONE }
}

impl Contestant for Scene {
    fn name(&self) -> &'static str {
        match self.mode {
            Mode::Default => "Embree",
            Mode::Robust => "robust",
            Mode::High => "high",
        }
    }

    fn bytes(&self) -> usize {
        self.bytes
    }

    fn closest(&self, rays: &[Ray], found: &mut [f32]) {
        let (intersect, mut context) = (self.device.functions.intersect, context());
        let hit = RtcHit { normal: [0.0; 3], uv: [0.0; 2], primitive: NONE, geometry: NONE, instance: NONE };
        for (ray, found) in rays.iter().zip(found) {
            let mut query = RtcRayHit { ray: RtcRay::of(ray), hit };
            // SAFETY: the scene is committed; context and query live on this stack, laid out and aligned as the header says.
            unsafe { intersect(self.scene, &raw mut context, &raw mut query) };
            *found = if query.hit.geometry == NONE { f32::INFINITY } else { query.ray.tfar };
        }
    }

    fn occluded(&self, rays: &[Ray], found: &mut [f32]) {
        let (occluded, mut context) = (self.device.functions.occluded, context());
        for (ray, found) in rays.iter().zip(found) {
            let mut query = RtcRay::of(ray);
            // SAFETY: as in `closest`.
            unsafe { occluded(self.scene, &raw mut context, &raw mut query) };
            *found = if query.tfar < 0.0 { 0.0 } else { f32::INFINITY };
        }
    }
}

/// A name of the version: 31305 is 3.13.5.
pub fn version_text(version: isize) -> String {
    format!("{}.{}.{}", version / 10_000, version / 100 % 100, version % 100)
}
