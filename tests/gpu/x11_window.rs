//! A window on an X server without a screen, as the tests of the swapchain need it.

use std::num::NonZeroU32;
use std::process::Command;
use std::ptr::NonNull;
use std::sync::{LazyLock, Mutex, MutexGuard};
use std::time::{Duration, Instant};

use crate::support::xserver::Server;
use raw_window_handle::{RawDisplayHandle, RawWindowHandle, XcbDisplayHandle, XcbWindowHandle};
use x11rb::connection::Connection;
use x11rb::protocol::xproto::{ConfigureWindowAux, ConnectionExt, CreateWindowAux, ImageFormat, WindowClass};
use x11rb::xcb_ffi::XCBConnection;

/// Serialises the tests of one binary: lavapipe keeps all cores busy anyway, and only one window is on top.
static TURN: Mutex<()> = Mutex::new(());

/// The server of this process, where `DISPLAY` names none.
static SERVER: LazyLock<Option<Server>> = LazyLock::new(|| {
    std::env::var_os("DISPLAY").is_none().then(|| {
        let server = Server::start(800, 600);
        end_with_process(server.pid());
        server
    })
});

/// Statics are not dropped: ends the server when the process ends.
fn end_with_process(pid: u32) {
    static PID: std::sync::atomic::AtomicU32 = std::sync::atomic::AtomicU32::new(0);
    extern "C" fn end() {
        let pid = PID.load(std::sync::atomic::Ordering::Relaxed);
        let _ = Command::new("kill").arg(pid.to_string()).status();
    }
    unsafe extern "C" {
        fn atexit(call: extern "C" fn()) -> i32;
    }
    PID.store(pid, std::sync::atomic::Ordering::Relaxed);
    // SAFETY: a function of the C library, called with a function that lives as long as the process.
    unsafe { atexit(end) };
}

/// A window without frame, at the left top of the screen.
pub struct Window {
    connection: XCBConnection,
    id: u32,
    visual: u32,
    screen: usize,
    _turn: Option<MutexGuard<'static, ()>>,
}

impl Window {
    /// A window of this size, once no other test of this binary has one.
    pub fn new(size: [u32; 2]) -> Self {
        Self::connect(Some(TURN.lock().unwrap_or_else(|e| e.into_inner())), size)
    }

    /// A second window of a test, above the first.
    pub fn new_beside(_first: &Window, size: [u32; 2]) -> Self {
        Self::connect(None, size)
    }

    /// A window on a server of the test's own.
    pub fn on(server: &Server, size: [u32; 2]) -> Self {
        Self::connect_to(Some(server), None, size)
    }

    fn connect(turn: Option<MutexGuard<'static, ()>>, size: [u32; 2]) -> Self {
        Self::connect_to(SERVER.as_ref(), turn, size)
    }

    fn connect_to(server: Option<&Server>, turn: Option<MutexGuard<'static, ()>>, size: [u32; 2]) -> Self {
        let display = server.map(|server| {
            assert!(server.is_alive(), "Xvfb has ended");
            std::ffi::CString::new(server.display.clone()).expect("no zero")
        });
        let (connection, screen) = XCBConnection::connect(display.as_deref()).expect("an X server");
        let mut window = Self { connection, id: 0, visual: 0, screen, _turn: turn };
        window.create(size);
        window
    }

    /// Makes the window, after it was destroyed for example.
    pub fn create(&mut self, [width, height]: [u32; 2]) {
        let root = &self.connection.setup().roots[self.screen];
        let (visual, parent, depth) = (root.root_visual, root.root, root.root_depth);
        let id = self.connection.generate_id().expect("an id");
        let look = CreateWindowAux::new().override_redirect(1).background_pixel(0x00ff_00ff);
        let (class, size) = (WindowClass::INPUT_OUTPUT, [width as u16, height as u16]);
        self.connection
            .create_window(depth, id, parent, 0, 0, size[0], size[1], 0, class, visual, &look)
            .expect("a window");
        self.connection.map_window(id).expect("a map");
        (self.id, self.visual) = (id, visual);
        self.sync();
    }

    /// Waits until the server has done everything that was asked.
    pub fn sync(&self) {
        self.connection.get_input_focus().expect("a request").reply().expect("a reply");
    }

    pub fn handles(&self) -> (RawDisplayHandle, RawWindowHandle) {
        let connection = NonNull::new(self.connection.get_raw_xcb_connection());
        let mut window = XcbWindowHandle::new(NonZeroU32::new(self.id).expect("an id"));
        window.visual_id = NonZeroU32::new(self.visual);
        (
            RawDisplayHandle::Xcb(XcbDisplayHandle::new(connection, self.screen as i32)),
            RawWindowHandle::Xcb(window),
        )
    }

    pub fn resize(&self, [width, height]: [u32; 2]) {
        let size = ConfigureWindowAux::new().width(width).height(height);
        self.connection.configure_window(self.id, &size).expect("a request");
        self.sync();
    }

    /// Destroys the window behind the program's back.
    pub fn destroy(&self) {
        self.connection.destroy_window(self.id).expect("a request");
        self.sync();
    }

    /// The left top rectangle as the screen shows it: red, green, blue for each pixel.
    pub fn pixels(&self, [width, height]: [u32; 2]) -> Vec<[u8; 3]> {
        let (format, size) = (ImageFormat::Z_PIXMAP, [width as u16, height as u16]);
        let request = self.connection.get_image(format, self.id, 0, 0, size[0], size[1], u32::MAX);
        let image = request.expect("a request").reply().expect("an image");
        // 24 bits deep, 32 bits per pixel, least significant byte first: blue, green, red, nothing.
        image.data.chunks_exact(4).map(|p| [p[2], p[1], p[0]]).collect()
    }

    /// Waits until the screen shows these pixels: showing is asynchronous.
    #[track_caller]
    pub fn shows(&self, size: [u32; 2], wanted: &[[u8; 3]]) {
        if let Err(pixels) = self.wait_for(size, |pixels| pixels == wanted) {
            let first = (0..pixels.len()).find(|i| wanted.get(*i) != Some(&pixels[*i])).unwrap_or(0);
            let (got, want) = (pixels.get(first), wanted.get(first));
            panic!("pixel {first} of {size:?} is {got:?} instead of {want:?}");
        }
    }

    /// Waits until what the screen shows passes a test.
    #[track_caller]
    pub fn shows_what(&self, size: [u32; 2], passes: impl Fn(&[[u8; 3]]) -> bool) {
        assert!(self.wait_for(size, passes).is_ok(), "the screen shows something else");
    }

    fn wait_for(&self, size: [u32; 2], passes: impl Fn(&[[u8; 3]]) -> bool) -> Result<(), Vec<[u8; 3]>> {
        let start = Instant::now();
        loop {
            let pixels = self.pixels(size);
            if passes(&pixels) {
                return Ok(());
            }
            if start.elapsed() > Duration::from_secs(10) {
                return Err(pixels);
            }
            std::thread::sleep(Duration::from_millis(5));
        }
    }
}
