//! A picture that is seen while it is rendered: in tev, which a thread of the test plays, and in snapshots on SIGUSR1.

use std::fs;
use std::io::{ErrorKind, Read};
use std::net::{TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use pointillist::image::exr;

/// An empty folder for one test.
fn folder(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("live").join(name);
    let _ = fs::remove_dir_all(&path);
    fs::create_dir_all(&path).unwrap();
    path
}

/// A render of the Cornell box, on the processor.
fn render(output: &Path, options: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_pointillist"));
    command.current_dir(env!("CARGO_MANIFEST_DIR")).args(["render", "scenes/cornell.xml", "-o"]).arg(output);
    command.args(["--size", "40x30", "--device", "cpu", "--threads", "1"]).args(options);
    command.stderr(Stdio::piped());
    command
}

/// A packet of tev's protocol (`src/Ipc.cpp` of tev), without its length.
#[derive(Debug, PartialEq)]
enum TevPacket {
    Create { name: String, size: [u32; 2], channels: Vec<String> },
    Update { name: String, size: [u32; 2], rgb: Vec<f32> },
}

/// Reads values of a packet one after the other.
struct PacketReader<'a>(&'a [u8]);

impl PacketReader<'_> {
    fn take<const N: usize>(&mut self) -> [u8; N] {
        let (head, rest) = self.0.split_first_chunk::<N>().expect("the packet is long enough");
        self.0 = rest;
        *head
    }

    fn u32(&mut self) -> u32 {
        u32::from_le_bytes(self.take())
    }

    fn text(&mut self) -> String {
        let end = self.0.iter().position(|byte| *byte == 0).expect("texts end with 0");
        let text = String::from_utf8(self.0[..end].to_vec()).expect("UTF-8");
        self.0 = &self.0[end + 1..];
        text
    }

    fn texts(&mut self) -> Vec<String> {
        (0..self.u32()).map(|_| self.text()).collect()
    }
}

/// The next packet; `None` when the program has closed the connection.
fn next_packet(connection: &mut TcpStream) -> Option<TevPacket> {
    let mut length = [0; 4];
    match connection.read_exact(&mut length) {
        Err(error) if error.kind() == ErrorKind::UnexpectedEof => return None,
        read => read.expect("a length"),
    }
    let mut bytes = vec![0; u32::from_le_bytes(length) as usize - 4];
    connection.read_exact(&mut bytes).expect("a whole packet");
    let mut packet = PacketReader(&bytes);
    let ([kind, _grab_focus], name) = (packet.take(), packet.text());
    Some(match kind {
        4 => {
            let size = [packet.u32(), packet.u32()];
            TevPacket::Create { name, size, channels: packet.texts() }
        }
        6 => {
            assert_eq!(packet.texts(), ["R", "G", "B"]);
            assert_eq!([packet.u32(), packet.u32()], [0, 0]);
            let size = [packet.u32(), packet.u32()];
            let layout: Vec<u64> = (0..6).map(|_| u64::from_le_bytes(packet.take())).collect();
            assert_eq!(layout, [0, 1, 2, 3, 3, 3], "offsets and strides");
            let values = packet.0.chunks_exact(4).map(|v| f32::from_le_bytes([v[0], v[1], v[2], v[3]]));
            TevPacket::Update { name, size, rgb: values.collect() }
        }
        kind => panic!("unexpected packet {kind}"),
    })
}

/// The pixels of an EXR file, three numbers each.
fn pixels(path: &Path) -> Vec<f32> {
    let layers = exr::read(path).unwrap();
    let [r, g, b] = ["R", "G", "B"].map(|name| layers.channel(name).unwrap());
    (0..r.len()).flat_map(|i| [r[i], g[i], b[i]]).collect()
}

/// tev closes the first connection after a picture: the program connects again, and the last picture is that of the file.
#[test]
fn tev_shows_the_picture_on_its_way() {
    let exr = folder("tev").join("picture.exr");
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    let viewer = thread::spawn(move || {
        let created = TevPacket::Create {
            name: "cornell".into(),
            size: [40, 30],
            channels: ["R", "G", "B"].map(String::from).into(),
        };
        let mut first = listener.accept().unwrap().0;
        assert_eq!(next_packet(&mut first), Some(created));
        let early = next_packet(&mut first);
        drop(first);
        let mut second = listener.accept().unwrap().0;
        assert!(matches!(next_packet(&mut second), Some(TevPacket::Create { .. })));
        let later: Vec<TevPacket> = std::iter::from_fn(|| next_packet(&mut second)).collect();
        (early, later)
    });
    let output = render(&exr, &["--time", "4", "--tev", &address]).output().unwrap();
    let messages = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{messages}");
    let (early, later) = viewer.join().unwrap();
    assert!(matches!(early, Some(TevPacket::Update { .. })), "{early:?}");
    assert!((2..=6).contains(&later.len()), "{} pictures in the rest of 4 s", later.len());
    assert_eq!(
        later.last(),
        Some(&TevPacket::Update { name: "cornell".into(), size: [40, 30], rgb: pixels(&exr) })
    );
    assert!(later.first() != later.last() && !messages.contains("no tev"), "{messages}");
}

/// Where there is no tev, one message says so and the picture is made all the same.
#[test]
fn a_render_goes_on_without_tev() {
    let exr = folder("no tev").join("picture.exr");
    // A port that is free: it was given to a listener that is gone.
    let address = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().to_string();
    let output = render(&exr, &["--time", "5", "--tev", &address]).output().unwrap();
    let messages = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success() && pixels(&exr).iter().any(|v| *v > 0.0), "{messages}");
    assert_eq!(messages.matches(&format!("no tev at {address}: ")).count(), 1, "{messages}");
    let output = render(&exr, &["--tev", "somewhere"]).output().unwrap();
    let messages = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(!output.status.success() && messages.contains("expected HOST:PORT"), "{messages}");
}

/// Asks a render for snapshots, of this number of files in `folder`, so long after it has begun.
#[cfg(unix)]
fn ask_for_snapshots(run: &mut Child, folder: &Path, count: usize, after: Duration) -> Vec<PathBuf> {
    let snapshots = || -> Vec<PathBuf> {
        let files = fs::read_dir(folder).unwrap().map(|file| file.unwrap().path());
        let name = |path: &PathBuf| path.file_name().unwrap().to_string_lossy().into_owned();
        files.filter(|path| name(path).starts_with("picture-") && !name(path).ends_with(".part")).collect()
    };
    // The signal would end the program before it listens: it does so before it reads the scene, and its threads start after that.
    let id = run.id();
    let threads = || fs::read_dir(format!("/proc/{id}/task")).map_or(0, Iterator::count);
    let deadline = Instant::now() + Duration::from_secs(60);
    let wait = |what: &str, done: &dyn Fn() -> bool| {
        while !done() {
            assert!(Instant::now() < deadline, "{what}");
            thread::sleep(Duration::from_millis(5));
        }
    };
    wait("the render does not begin", &|| threads() > 2);
    thread::sleep(after);
    assert!(Command::new("kill").args(["-USR1", &id.to_string()]).status().unwrap().success());
    wait("there are no snapshots", &|| snapshots().len() == count);
    assert!(run.try_wait().unwrap().is_none(), "the render has ended before its snapshots");
    snapshots()
}

/// Snapshots are pictures of their own, and the last picture has the bytes of an undisturbed render.
#[cfg(unix)]
#[test]
fn a_signal_asks_for_a_snapshot() {
    let folder = folder("snapshot");
    let (alone, exr) = (folder.join("alone.exr"), folder.join("picture.exr"));
    let options = ["--spp", "1500", "--deterministic", "--quiet"];
    assert!(render(&alone, &options).status().unwrap().success());
    let mut run = render(&exr, &options).arg("-o").arg(folder.join("picture.png")).spawn().unwrap();
    let snapshots = ask_for_snapshots(&mut run, &folder, 2, Duration::ZERO);
    assert!(run.wait().unwrap().success());
    assert!(fs::read(&alone).unwrap() == fs::read(&exr).unwrap(), "the snapshot has disturbed the render");
    let early = snapshots.into_iter().find(|path| path.extension().is_some_and(|e| e == "exr")).unwrap();
    let spp = early.file_stem().unwrap().to_string_lossy().into_owned();
    let spp: u32 = spp.trim_start_matches("picture-").trim_end_matches("spp").parse().unwrap();
    assert!(spp < 1500, "{}", early.display());
    let mean = |path: &Path| pixels(path).iter().map(|v| f64::from(*v)).sum::<f64>();
    let ratio = mean(&early) / mean(&exr);
    assert!((ratio - 1.0).abs() < 0.2 && pixels(&early) != pixels(&exr), "{ratio}");
}

/// With two eyes snapshots are those of both, in all formats of the last pictures.
#[cfg(unix)]
#[test]
fn snapshots_show_both_eyes() {
    let folder = folder("snapshot of both eyes");
    let exr = folder.join("picture.exr");
    let mut command = render(&exr, &["--spp", "1500", "--quiet", "--stereo", "pair"]);
    for name in ["picture.png", "picture.jps"] {
        command.arg("-o").arg(folder.join(name));
    }
    let mut run = command.spawn().unwrap();
    let snapshots = ask_for_snapshots(&mut run, &folder, 4, Duration::from_millis(300));
    assert!(run.wait().unwrap().success());
    let ends_in = |end: &str| snapshots.iter().find(|path| path.to_string_lossy().ends_with(end));
    assert!(ends_in("spp_left.png").is_some() && ends_in("spp_right.png").is_some(), "{snapshots:?}");
    let jps = fs::read(ends_in("spp.jps").expect("a JPS file")).unwrap();
    assert!(jps.windows(8).any(|bytes| bytes == b"_JPSJPS_"));
    let (early, last) =
        (exr::read(ends_in("spp.exr").expect("an EXR file")).unwrap(), exr::read(&exr).unwrap());
    assert_eq!(early.views, ["left", "right"]);
    let mean = |layers: &exr::Layers, view: &str| {
        let view = layers.view(view).unwrap();
        view.channel("G").unwrap().iter().map(|v| f64::from(*v)).sum::<f64>()
    };
    for view in ["left", "right"] {
        let ratio = mean(&early, view) / mean(&last, view);
        assert!((ratio - 1.0).abs() < 0.2, "{view}: {ratio}");
    }
    assert!(early.view("right").unwrap().channel("G") != last.view("right").unwrap().channel("G"));
}

/// tev shows a picture of each eye by its name.
#[test]
fn tev_shows_both_eyes() {
    let exr = folder("tev of both eyes").join("picture.exr");
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    let viewer = thread::spawn(move || {
        let mut connection = listener.accept().unwrap().0;
        std::iter::from_fn(|| next_packet(&mut connection)).collect::<Vec<_>>()
    });
    let output = render(&exr, &["--spp", "64", "--stereo", "--tev", &address]).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let packets = viewer.join().unwrap();
    let file = exr::read(&exr).unwrap();
    for eye in ["left", "right"] {
        let wanted = format!("cornell {eye}");
        let created =
            packets.iter().filter(|p| matches!(p, TevPacket::Create { name, .. } if *name == wanted));
        assert_eq!(created.count(), 1, "{eye}");
        let last = packets.iter().rev().find_map(|packet| match packet {
            TevPacket::Update { name, rgb, .. } if *name == wanted => Some(rgb),
            _ => None,
        });
        let view = file.view(eye).unwrap();
        let [r, g, b] = ["R", "G", "B"].map(|name| view.channel(name).unwrap());
        let pixels: Vec<f32> = (0..r.len()).flat_map(|i| [r[i], g[i], b[i]]).collect();
        assert_eq!(last, Some(&pixels), "{eye}");
    }
}
