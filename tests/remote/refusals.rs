//! Who is not let in: without the token, with another version, with noise. One line in the log for each, and the next one is served.

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::time::{Duration, Instant};

use pointillist::math::bits::mix;
use pointillist::remote::{Health, ListenError, Token, listen};

use crate::held_memory;
use crate::host::{FakeViewer, PATIENCE, Served, address};

const TOKEN: &str = "a secret of more than 16 letters";

#[test]
fn without_a_token_only_this_machine_is_served() {
    for open in ["0.0.0.0:0", "[::]:0"] {
        assert!(matches!(listen(open, None), Err(ListenError::Open { .. })), "{open}");
        assert!(listen(open, Token::new(TOKEN).as_ref()).is_ok() || open.starts_with('['));
    }
    for here in ["127.0.0.1:0", "localhost:0"] {
        assert!(listen(here, None).unwrap().local_addr().unwrap().ip().is_loopback());
    }
    assert!(matches!(listen("7070", None), Err(ListenError::Address { .. })));
    assert!(Token::new("too short").is_none());
}

/// A viewer is told why it is refused, and the log of the tracer has a line.
#[test]
fn the_token_must_be_the_same() {
    let secret = Served::start(Some(TOKEN));
    let open = Served::start(None);
    let told = |served: &Served, token: Option<&str>, words: &str, logged: &str| {
        let mut viewer = FakeViewer::of(vec![address(&served.address, token)]);
        viewer.render(None);
        viewer.hears(0, Health::Ill, words);
        assert_eq!(viewer.tracers.samples(), 0);
        assert!(served.logged().iter().any(|line| line.contains(logged)), "{:?}", served.logged());
    };
    told(
        &secret,
        Some("another secret, as long as the one"),
        "token is not the same",
        "token is not the same",
    );
    told(&secret, None, "it wants a token", "it has no token");
    told(&open, Some(TOKEN), "has no token", "wants a token");
    let mut viewer = FakeViewer::of(vec![address(&secret.address, Some(TOKEN))]);
    viewer.render(None);
    viewer.receive(1000);
}

/// A second viewer is told that there is one, and served when that has gone.
#[test]
fn one_viewer_at_a_time() {
    let served = Served::start(None);
    let mut first = FakeViewer::of(vec![address(&served.address, None)]);
    first.render(None);
    first.receive(1000);
    let mut second = FakeViewer::of(vec![address(&served.address, None)]);
    second.render(None);
    second.hears(0, Health::Ill, "another viewer");
    drop(first);
    second.receive(1000);
}

/// What the tracer answers to these bytes before it closes the connection.
fn answer(served: &Served, bytes: &[u8]) -> Vec<u8> {
    let mut socket = TcpStream::connect(&served.address).unwrap();
    socket.set_read_timeout(Some(PATIENCE)).unwrap();
    let _ = socket.write_all(bytes);
    let _ = socket.shutdown(std::net::Shutdown::Write);
    let mut said = Vec::new();
    let _ = socket.read_to_end(&mut said);
    said
}

/// Waits until the log has so many lines of ends.
#[track_caller]
fn lines(served: &Served, count: usize) -> Vec<String> {
    let start = Instant::now();
    loop {
        let ends: Vec<String> =
            served.logged().into_iter().filter(|line| !line.ends_with(": connected")).collect();
        if ends.len() >= count {
            return ends;
        }
        assert!(start.elapsed() < PATIENCE, "{} lines of {count}", ends.len());
        std::thread::sleep(Duration::from_millis(5));
    }
}

const HELLO: &[u8] = b"PNTLLIVE\x02\x00\x00";

/// A copy of what a viewer with the token has sent gets nobody in: the first message of the handshake could be an old one.
#[test]
fn a_recorded_greeting_gets_nobody_in() {
    let served = Served::start(Some(TOKEN));
    let recorder = TcpListener::bind("127.0.0.1:0").unwrap();
    let here = recorder.local_addr().unwrap().to_string();
    let viewer = FakeViewer::of(vec![address(&here, Some(TOKEN))]);
    let (mut socket, _) = recorder.accept().unwrap();
    let mut recorded = vec![0; 11];
    socket.read_exact(&mut recorded).unwrap();
    socket.write_all(b"PNTLLIVE\x02\x00\x01").unwrap();
    let mut message = [0; 48];
    socket.read_exact(&mut message).unwrap();
    recorded.extend(message);
    drop((socket, recorder));
    drop(viewer);
    // The answer is a greeting and the second message, and then the end: no welcome.
    assert_eq!(answer(&served, &recorded).len(), 11 + 48);
    assert!(!served.logged().iter().any(|line| line.ends_with("connected")), "{:?}", served.logged());
}

#[test]
fn strangers_are_refused_with_a_line_each() {
    let served = Served::start(None);
    let oversized = [HELLO, &[1, 0xff, 0xff, 0xff, 0xff]].concat();
    let samples_from_a_viewer = [HELLO, &[66, 8, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8]].concat();
    let no_json = [HELLO, &[1, 3, 0, 0, 0], b"{{{"].concat();
    let deep = [HELLO, &[1, 0, 0, 8, 0], &[b'['; 1 << 19]].concat();
    let cases: [(&[u8], &str); 8] = [
        (b"GET / HTTP/1.1\r\n\r\n", "does not speak the protocol"),
        (b"", "gone"),
        (b"PNTLLIVE\x01\x00\x00", "version 1"),
        (&HELLO[..5], "gone"),
        (&oversized, "4294967295 bytes, of which 1048576"),
        (&samples_from_a_viewer, "unknown kind 66"),
        (&no_json, "makes no sense"),
        (&deep, "makes no sense"),
    ];
    for (count, (bytes, words)) in cases.iter().enumerate() {
        answer(&served, bytes);
        let lines = lines(&served, count + 1);
        assert_eq!(lines.len(), count + 1, "{lines:?}");
        assert!(lines[count].contains(words), "{words}: {lines:?}");
    }
    // One that says nothing does not keep others out.
    let silent: Vec<TcpStream> = (0..4).map(|_| TcpStream::connect(&served.address).unwrap()).collect();
    let mut viewer = FakeViewer::of(vec![address(&served.address, None)]);
    viewer.render(None);
    viewer.receive(1000);
    drop(silent);
}

/// A thousand connections with noise, half of them after a proper greeting: a line each, no memory, and the next viewer is served.
#[test]
fn noise_leaves_nothing_behind() {
    let served = Served::start(None);
    answer(&served, b"");
    let held = held_memory::start();
    for k in 0..1000u64 {
        let length = mix(k) % 2000;
        let noise = (0..length).map(|i| mix(k << 32 | i) as u8);
        let greeting = if k % 2 == 0 { HELLO } else { &[] };
        let bytes: Vec<u8> = greeting.iter().copied().chain(noise).collect();
        answer(&served, &bytes);
    }
    let lines = lines(&served, 1001);
    assert!(
        lines.len() <= 1001 && lines.iter().all(|line| line.len() < 300 && !line.contains('\n')),
        "{}",
        lines.len()
    );
    // Other tests of this program hold memory at the same time.
    assert!(held_memory::peak_since(held) < held_memory::MOST / 4, "{} bytes", held_memory::peak_since(held));
    let mut viewer = FakeViewer::of(vec![address(&served.address, None)]);
    viewer.render(None);
    viewer.receive(1000);
}
