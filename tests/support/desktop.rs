//! A display of its own (Xvfb) with synthetic mouse and keyboard, for tests and tools that use the window as a user does.

use std::time::{Duration, Instant};

use super::xserver::Server;
use x11rb::connection::Connection;
use x11rb::protocol::xproto::{self, ConnectionExt as _, ImageFormat};
use x11rb::protocol::xtest::ConnectionExt as _;
use x11rb::rust_connection::RustConnection;

/// An X server without a screen, and a connection to it. Dropping it ends the server.
pub struct Desktop {
    _server: Server,
    /// Its name, such as `:99`.
    pub display: String,
    connection: RustConnection,
    root: xproto::Window,
}

impl Desktop {
    /// Starts a server with a screen of this size, under the first free number.
    ///
    /// # Panics
    ///
    /// When Xvfb is not installed.
    pub fn start(width: u32, height: u32) -> Self {
        let server = Server::start(width, height);
        let display = server.display.clone();
        let (connection, screen) = RustConnection::connect(Some(&display)).expect("the new display");
        let root = connection.setup().roots[screen].root;
        Self { _server: server, display, connection, root }
    }

    /// The window whose title contains `title`, once it is mapped and drawn into.
    pub fn find(&self, title: &str, timeout: Duration) -> Option<xproto::Window> {
        let start = Instant::now();
        while start.elapsed() < timeout {
            let tree = self.connection.query_tree(self.root).ok()?.reply().ok()?;
            if let Some(window) = tree.children.into_iter().find(|w| self.title(*w).contains(title)) {
                return Some(window);
            }
            std::thread::sleep(Duration::from_millis(20));
        }
        None
    }

    fn title(&self, window: xproto::Window) -> String {
        let (name, kind) = (xproto::AtomEnum::WM_NAME, xproto::AtomEnum::ANY);
        let reply = self.connection.get_property(false, window, name, kind, 0, 256);
        reply
            .ok()
            .and_then(|cookie| cookie.reply().ok())
            .map(|r| String::from_utf8_lossy(&r.value).into_owned())
            .unwrap_or_default()
    }

    /// Moves the pointer, in pixels of the screen.
    pub fn pointer(&self, x: i32, y: i32) {
        self.fake(xproto::MOTION_NOTIFY_EVENT, 0, (x, y));
    }

    /// Presses or releases a mouse button: 1 left, 2 middle, 3 right, 4 and 5 wheel.
    pub fn button(&self, number: u8, down: bool) {
        let kind = if down { xproto::BUTTON_PRESS_EVENT } else { xproto::BUTTON_RELEASE_EVENT };
        self.fake(kind, number, (0, 0));
    }

    /// Presses or releases the key that gives this keysym without modifiers.
    pub fn key(&self, keysym: u32, down: bool) {
        let setup = self.connection.setup();
        let (first, count) = (setup.min_keycode, setup.max_keycode - setup.min_keycode + 1);
        let Some(map) =
            self.connection.get_keyboard_mapping(first, count).ok().and_then(|cookie| cookie.reply().ok())
        else {
            return;
        };
        let per_code = usize::from(map.keysyms_per_keycode.max(1));
        if let Some(at) = map.keysyms.chunks(per_code).position(|syms| syms.first() == Some(&keysym)) {
            let kind = if down { xproto::KEY_PRESS_EVENT } else { xproto::KEY_RELEASE_EVENT };
            self.fake(kind, first + at as u8, (0, 0));
        }
    }

    fn fake(&self, kind: u8, detail: u8, (x, y): (i32, i32)) {
        let _ = self.connection.xtest_fake_input(kind, detail, 0, self.root, x as i16, y as i16, 0);
        let _ = self.connection.flush();
    }

    /// Gives the window another size.
    pub fn resize(&self, window: xproto::Window, width: u32, height: u32) {
        let size = xproto::ConfigureWindowAux::new().width(width).height(height);
        let _ = self.connection.configure_window(window, &size);
        let _ = self.connection.flush();
    }

    /// The window's pixels as B, G, R, unused; with its width and height. `None` when it is gone.
    pub fn pixels(&self, window: xproto::Window) -> Option<(u32, u32, Vec<u8>)> {
        let size = self.connection.get_geometry(window).ok()?.reply().ok()?;
        let (w, h) = (size.width, size.height);
        let image =
            self.connection.get_image(ImageFormat::Z_PIXMAP, window, 0, 0, w, h, !0).ok()?.reply().ok()?;
        Some((u32::from(w), u32::from(h), image.data))
    }
}
