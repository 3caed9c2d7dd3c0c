//! A network between viewer and tracer that can be slow, stand still, break, or change what is said.

use std::io::{ErrorKind, Read, Write};
use std::net::{Shutdown, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// What happens to what the tracer says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Weather {
    Fine,
    /// Nothing passes, in either direction.
    Still,
    /// So many bytes a second.
    Slow(usize),
    /// All connections are broken, and new ones are refused.
    Broken,
    /// Noise comes in the place of what was said.
    Noise,
}

/// A proxy in front of a tracer.
pub struct Proxy {
    pub address: String,
    weather: Arc<Mutex<Weather>>,
    closing: Arc<AtomicBool>,
}

impl Proxy {
    pub fn start(target: &str) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap().to_string();
        let (weather, closing) = (Arc::new(Mutex::new(Weather::Fine)), Arc::<AtomicBool>::default());
        listener.set_nonblocking(true).unwrap();
        let (now, over, target) = (weather.clone(), closing.clone(), target.to_owned());
        std::thread::spawn(move || {
            while !over.load(Ordering::SeqCst) {
                let Ok((viewer, _)) = listener.accept() else {
                    std::thread::sleep(Duration::from_millis(5));
                    continue;
                };
                let Ok(tracer) = TcpStream::connect(&target) else { continue };
                viewer.set_nonblocking(false).unwrap();
                for (from, to, noisy) in [(&viewer, &tracer, false), (&tracer, &viewer, true)] {
                    let (from, to) = (from.try_clone().unwrap(), to.try_clone().unwrap());
                    let (now, over) = (now.clone(), over.clone());
                    std::thread::spawn(move || pass(from, to, noisy, &now, &over));
                }
            }
        });
        Self { address, weather, closing }
    }

    pub fn set(&self, weather: Weather) {
        *self.weather.lock().unwrap() = weather;
    }
}

impl Drop for Proxy {
    fn drop(&mut self) {
        self.closing.store(true, Ordering::SeqCst);
    }
}

fn pass(mut from: TcpStream, mut to: TcpStream, noisy: bool, now: &Mutex<Weather>, over: &AtomicBool) {
    from.set_read_timeout(Some(Duration::from_millis(10))).unwrap();
    let mut bytes = vec![0; 64 << 10];
    while !over.load(Ordering::SeqCst) {
        let weather = *now.lock().unwrap();
        let most = match weather {
            Weather::Still => {
                std::thread::sleep(Duration::from_millis(5));
                continue;
            }
            Weather::Broken => break,
            Weather::Slow(rate) if noisy => {
                std::thread::sleep(Duration::from_millis(20));
                (rate / 50).clamp(1, bytes.len())
            }
            _ => bytes.len(),
        };
        let count = match from.read(&mut bytes[..most]) {
            Ok(0) => break,
            Ok(count) => count,
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => continue,
            Err(_) => break,
        };
        if noisy && *now.lock().unwrap() == Weather::Noise {
            bytes[..count].iter_mut().enumerate().for_each(|(i, byte)| *byte = (i * 37 + 11) as u8);
        }
        if to.write_all(&bytes[..count]).is_err() {
            break;
        }
    }
    let _ = from.shutdown(Shutdown::Both);
    let _ = to.shutdown(Shutdown::Both);
}
