//! A display of its own (Xvfb) with synthetic mouse and keyboard, for tests and tools that use the window as a user does.

use std::path::Path;
use std::time::{Duration, Instant};

use super::xserver::Server;
use x11rb::CURRENT_TIME;
use x11rb::connection::Connection;
use x11rb::protocol::Event;
use x11rb::protocol::xproto::{self, ConnectionExt as _, ImageFormat};
use x11rb::protocol::xtest::ConnectionExt as _;
use x11rb::rust_connection::RustConnection;
use x11rb::wrapper::ConnectionExt as _;

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

    /// The window whose title contains `title`, once it is on the screen: its pixels cannot be read before.
    pub fn find(&self, title: &str, timeout: Duration) -> Option<xproto::Window> {
        let start = Instant::now();
        while start.elapsed() < timeout {
            let tree = self.connection.query_tree(self.root).ok()?.reply().ok()?;
            let is_it = |w: &xproto::Window| self.title(*w).contains(title) && self.is_shown(*w);
            if let Some(window) = tree.children.into_iter().find(is_it) {
                return Some(window);
            }
            std::thread::sleep(Duration::from_millis(20));
        }
        None
    }

    /// The window whose title contains `title`, once a tenth of its pixels is bright, as of a picture and not of the words that are shown while
    /// the scene is loaded.
    pub fn find_picture(&self, title: &str, timeout: Duration) -> Option<xproto::Window> {
        let start = Instant::now();
        let window = self.find(title, timeout)?;
        let is_picture = || {
            self.pixels(window).is_some_and(|(width, height, pixels)| {
                let bright = pixels.chunks_exact(4).filter(|bgrx| bgrx[..3].iter().any(|c| *c > 60)).count();
                10 * bright > (width * height) as usize
            })
        };
        while !is_picture() {
            if start.elapsed() > timeout {
                return None;
            }
            std::thread::sleep(Duration::from_millis(20));
        }
        Some(window)
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

    /// Gives the window the keyboard, as a window manager does. A server refuses that to a window that it does not show yet,
    /// so it is asked again until the window has the keyboard. True when it has.
    pub fn focus(&self, window: xproto::Window, timeout: Duration) -> bool {
        let start = Instant::now();
        let has_keyboard = || {
            let _ = self.connection.set_input_focus(xproto::InputFocus::PARENT, window, CURRENT_TIME);
            let focus = self.connection.get_input_focus().ok().and_then(|cookie| cookie.reply().ok());
            focus.is_some_and(|reply| reply.focus == window)
        };
        while !has_keyboard() {
            if start.elapsed() > timeout {
                return false;
            }
            std::thread::sleep(Duration::from_millis(20));
        }
        true
    }

    /// Gives the window another size.
    pub fn resize(&self, window: xproto::Window, width: u32, height: u32) {
        // Into the corner: the pixels of a window can be read where all of it is on the screen.
        let size = xproto::ConfigureWindowAux::new().x(0).y(0).width(width).height(height);
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

    /// Drops a file onto the middle of the window, as a file manager does (XDND, version 5). True when the window has taken it.
    pub fn drop_file(&self, window: xproto::Window, path: &Path, timeout: Duration) -> bool {
        self.drop_text(window, &format!("file://{}\r\n", path.display()), timeout).is_some()
    }

    fn drop_text(&self, window: xproto::Window, text: &str, timeout: Duration) -> Option<()> {
        let connection = &self.connection;
        let atom = |name: &str| Some(connection.intern_atom(false, name.as_bytes()).ok()?.reply().ok()?.atom);
        let [enter, position, status, drop, finished, selection, list, copy] = [
            "XdndEnter",
            "XdndPosition",
            "XdndStatus",
            "XdndDrop",
            "XdndFinished",
            "XdndSelection",
            "text/uri-list",
            "XdndActionCopy",
        ]
        .map(atom);
        let (drop, finished, selection, list) = (drop?, finished?, selection?, list?);
        let source = connection.generate_id().ok()?;
        let aux = xproto::CreateWindowAux::new();
        let kind = xproto::WindowClass::INPUT_ONLY;
        connection.create_window(0, source, self.root, 0, 0, 1, 1, 0, kind, 0, &aux).ok()?;
        connection.set_selection_owner(source, selection, CURRENT_TIME).ok()?;
        let send = |kind: xproto::Atom, data: [u32; 4]| {
            let [a, b, c, d] = data;
            let message = xproto::ClientMessageEvent::new(32, window, kind, [source, a, b, c, d]);
            connection.send_event(false, window, xproto::EventMask::NO_EVENT, message).ok()?;
            connection.flush().ok()
        };
        let size = connection.get_geometry(window).ok()?.reply().ok()?;
        let middle = u32::from(size.width / 2) << 16 | u32::from(size.height / 2);
        send(enter?, [5 << 24, list, 0, 0])?;
        send(position?, [0, middle, CURRENT_TIME, copy?])?;
        let (start, mut accepted, mut handed) = (Instant::now(), false, false);
        while start.elapsed() < timeout {
            match connection.poll_for_event().ok()? {
                Some(Event::SelectionRequest(request)) => {
                    let (replace, bytes) = (xproto::PropMode::REPLACE, text.as_bytes());
                    connection
                        .change_property8(replace, request.requestor, request.property, list, bytes)
                        .ok()?;
                    let notice = xproto::SelectionNotifyEvent {
                        response_type: xproto::SELECTION_NOTIFY_EVENT,
                        sequence: 0,
                        time: request.time,
                        requestor: request.requestor,
                        selection: request.selection,
                        target: request.target,
                        property: request.property,
                    };
                    let mask = xproto::EventMask::NO_EVENT;
                    connection.send_event(false, request.requestor, mask, notice).ok()?;
                    handed = true;
                }
                Some(Event::ClientMessage(message)) if Some(message.type_) == status => accepted = true,
                Some(Event::ClientMessage(message)) if message.type_ == finished => return Some(()),
                Some(_) => continue,
                None => std::thread::sleep(Duration::from_millis(5)),
            }
            if accepted && handed {
                (accepted, handed) = (false, false);
                send(drop, [0, CURRENT_TIME, 0, 0])?;
            }
        }
        None
    }

    /// The title of the window.
    pub fn title(&self, window: xproto::Window) -> String {
        let (name, kind) = (xproto::AtomEnum::WM_NAME, xproto::AtomEnum::ANY);
        let reply = self.connection.get_property(false, window, name, kind, 0, 256);
        reply
            .ok()
            .and_then(|cookie| cookie.reply().ok())
            .map(|r| String::from_utf8_lossy(&r.value).into_owned())
            .unwrap_or_default()
    }

    /// True when the server shows the window; one that is not mapped yet has no pixels.
    fn is_shown(&self, window: xproto::Window) -> bool {
        let attributes = self.connection.get_window_attributes(window);
        attributes
            .ok()
            .and_then(|cookie| cookie.reply().ok())
            .is_some_and(|r| r.map_state == xproto::MapState::VIEWABLE)
    }
}
