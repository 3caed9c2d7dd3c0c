//! A thousand broken scene files and a thousand broken meshes: each is read, or refused with a place.
//!
//! The guard can fail: a counting allocator bounds what the reader holds at any time, and a watchdog
//! ends the test when one file takes longer than any of them may.

use std::alloc::{GlobalAlloc, Layout, System};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError, mpsc};
use std::time::Duration;

use miette::{GraphicalReportHandler, GraphicalTheme};
use pointillist::scene::{SceneError, load, load_str};

/// What one small broken file may make the reader hold, in bytes. Inputs here are below 2 MB.
const MEMORY: usize = 256 << 20;

/// What one file may take. Hundreds of times what the slowest needs, so that a busy machine does not
/// matter, but an endless loop does.
const TIME: Duration = Duration::from_secs(60);

/// Counts the bytes held, and the most ever held.
struct Counting;

static HELD: AtomicUsize = AtomicUsize::new(0);
static PEAK: AtomicUsize = AtomicUsize::new(0);

// SAFETY: every call is passed on to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let held = HELD.fetch_add(layout.size(), Ordering::Relaxed) + layout.size();
        PEAK.fetch_max(held, Ordering::Relaxed);
        // SAFETY: the caller keeps the contract of `alloc`.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        HELD.fetch_sub(layout.size(), Ordering::Relaxed);
        // SAFETY: the caller keeps the contract of `dealloc`.
        unsafe { System.dealloc(pointer, layout) }
    }
}

/// One at a time, so that what is counted is the reader's alone.
static ALONE: Mutex<()> = Mutex::new(());

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Runs `work` on a thread with a small stack and fails if it panics, takes too long or too much.
fn guarded<T: Send + 'static>(what: &str, work: impl FnOnce() -> T + Send + 'static) -> T {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let (done, wait) = mpsc::channel();
    PEAK.store(HELD.load(Ordering::Relaxed), Ordering::Relaxed);
    let before = HELD.load(Ordering::Relaxed);
    let thread = std::thread::Builder::new().stack_size(1 << 20);
    let handle = thread
        .spawn(move || {
            let result = work();
            let _ = done.send(()); // nobody listens any more if it took too long
            result
        })
        .expect("a thread");
    if wait.recv_timeout(TIME) == Err(mpsc::RecvTimeoutError::Timeout) {
        panic!("{what}: still not done after {TIME:?}");
    }
    let result = handle.join().unwrap_or_else(|_| panic!("{what}: the reader panicked"));
    let peak = PEAK.load(Ordering::Relaxed).saturating_sub(before);
    assert!(peak < MEMORY, "{what}: held {peak} bytes");
    result
}

/// Numbers that are the same each time: xorshift64* (Vigna 2016).
struct Random(u64);

impl Random {
    fn below(&mut self, n: usize) -> usize {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 33) as usize % n.max(1)
    }

    fn pick<'a>(&mut self, from: &[&'a str]) -> &'a str {
        from[self.below(from.len())]
    }
}

/// Numbers that break readers.
const NUMBERS: &[&str] = &[
    "nan",
    "-nan",
    "inf",
    "-inf",
    "1e39",
    "-1e39",
    "1e308",
    "1e999",
    "1e-999",
    "-0",
    "0",
    "4294967296",
    "2147483648",
    "-2147483649",
    "9223372036854775807",
    "-9223372036854775808",
    "18446744073709551616",
    "0x10",
    "1e",
    "",
    "++1",
    "1.5.2",
    "-1",
];

/// Pieces of XML in wrong places.
const PIECES: &[&str] = &[
    "<scene>",
    "</scene>",
    "<!--",
    "-->",
    "<![CDATA[",
    "]]>",
    "<?",
    "?>",
    "<!DOCTYPE a [",
    "&lt;",
    "&#0;",
    "&#x110000;",
    "&a;",
    "\"",
    "'",
    "<",
    ">",
    "/>",
    "$",
    "$$",
    "$nothing",
    "xmlns:a=\"b\"",
    "\u{0}",
    "\u{feff}",
    "\u{202e}",
    "é",
    "<shape type=\"obj\">",
    "<ref id=\"x\"/>",
    "<include filename=\"/dev/zero\"/>",
    "<include filename=\".\"/>",
    "<default name=\"\" value=\"$\"/>",
];

/// Pieces of OBJ in wrong places.
const LINES: &[&str] = &[
    "f 1 2 3",
    "f 0 0 0",
    "f -1 -2 -3",
    "f 1",
    "f 1 2",
    "f",
    "f 1//1 2/2 3",
    "f 1/2/3/4 1 1",
    "f 99999999999999999999 1 2",
    "f -9223372036854775808 1 2",
    "v",
    "v 1",
    "v nan nan nan",
    "v inf 0 0",
    "v 1e999 0 0",
    "v 1 2 3 4 5 6 7",
    "vt",
    "vt nan nan",
    "vn 0 0 0",
    "vn nan 0 0",
    "l 1 2",
    "p 1",
    "usemtl x",
    "mtllib /dev/zero",
    "g",
    "o",
    "s off",
    "#",
    "\\",
    "vp 1 2",
    "curv 0 1 1 2",
    "f 1 2 3 \\",
    "\u{0}",
];

/// One change to `bytes`.
fn corrupt(bytes: &mut Vec<u8>, random: &mut Random, pieces: &[&str]) {
    let at = random.below(bytes.len());
    match random.below(8) {
        0 => bytes.truncate(at),
        1 => bytes[at] ^= 1 << random.below(8),
        2 => bytes[at] = random.below(256) as u8,
        3 => {
            let end = (at + 1 + random.below(40)).min(bytes.len());
            bytes.drain(at..end);
        }
        4 => {
            let end = (at + 1 + random.below(200)).min(bytes.len());
            let copy = bytes[at..end].to_vec();
            let to = random.below(bytes.len());
            bytes.splice(to..to, copy);
        }
        5 => drop(bytes.splice(at..at, random.pick(pieces).bytes())),
        _ => number(bytes, at, random.pick(NUMBERS)),
    }
    if bytes.is_empty() {
        bytes.push(b'\n');
    }
}

/// Replaces the first number after `at`.
fn number(bytes: &mut Vec<u8>, at: usize, new: &str) {
    let digit = |b: &u8| b.is_ascii_digit() || *b == b'.' || *b == b'-';
    if let Some(start) = bytes[at..].iter().position(digit).map(|p| at + p) {
        let end = bytes[start..].iter().position(|b| !digit(b)).map_or(bytes.len(), |p| start + p);
        bytes.splice(start..end, new.bytes());
    }
}

fn render(d: &dyn miette::Diagnostic) -> String {
    let mut out = String::new();
    let handler = GraphicalReportHandler::new_themed(GraphicalTheme::unicode_nocolor());
    handler.render_report(&mut out, d).expect("a string never fails");
    out
}

/// The message shows `file:line:column` of one of the files, and is of a readable size.
fn assert_has_place(what: &str, shown: &str, names: &[&str]) {
    let numbered = |rest: &str| {
        let mut parts = rest.split(|c: char| !c.is_ascii_digit());
        parts.next().is_some_and(|line| line.parse::<u32>().is_ok_and(|l| l > 0))
    };
    let places = |name: &str| {
        shown.match_indices(name).any(|(i, n)| shown[i + n.len()..].strip_prefix(':').is_some_and(numbered))
    };
    assert!(names.iter().any(|n| places(n)), "{what}: no place in\n{shown}");
    assert!(shown.len() < 20_000, "{what}: {} bytes of message", shown.len());
}

/// An empty folder for this test's files.
fn folder(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = std::fs::remove_dir_all(&path); // not there the first time
    std::fs::create_dir_all(&path).expect("a writable target folder");
    path
}

const SCENE: &str = r#"<?xml version="1.0" encoding="utf-8"?>
<!-- A scene with a little of everything. -->
<scene version="3.0.0">
  <default name="spp" value="16"/>
  <path value="."/>
  <include filename="part.xml"/>
  <integrator type="path"><integer name="max_depth" value="6"/><boolean name="hide_emitters" value="false"/></integrator>
  <sensor type="perspective">
    <float name="fov" value="40"/><string name="fov_axis" value="x"/>
    <float name="near_clip" value="0.1"/><float name="far_clip" value="100"/>
    <transform name="to_world"><lookat origin="0, 1, -5" target="0, 1, 0" up="0, 1, 0"/></transform>
    <sampler type="independent"><integer name="sample_count" value="$spp"/></sampler>
    <film type="hdrfilm">
      <integer name="width" value="64"/><integer name="height" value="48"/>
      <integer name="crop_offset_x" value="3"/><integer name="crop_width" value="10"/><rfilter type="box"/>
    </film>
  </sensor>
  <bsdf type="diffuse" id="red"><rgb name="reflectance" value="0.6, 0.1, 0.1"/></bsdf>
  <bsdf type="twosided" id="both"><ref id="red"/><bsdf type="diffuse"><spectrum name="reflectance" value="400:0.1, 700:0.9"/></bsdf></bsdf>
  <alias id="red" as="crimson"/>
  <shape type="obj">
    <string name="filename" value="mesh.obj"/><ref id="crimson"/>
    <transform name="to_world"><scale x="1" y="2" z="3"/><rotate y="1" angle="30"/><translate value="1 2 3"/></transform>
  </shape>
  <shape type="sphere"><point name="center" x="0" y="1" z="0"/><float name="radius" value="0.5"/>
    <bsdf type="dielectric"><float name="int_ior" value="1.5"/><float name="ext_ior" value="1"/></bsdf></shape>
  <shape type="rectangle"><transform name="to_world"><matrix value="1 0 0 0 0 1 0 0 0 0 1 2 0 0 0 1"/></transform>
    <emitter type="area"><rgb name="radiance" value="10"/></emitter></shape>
  <shape type="disk"><bsdf type="conductor"><string name="material" value="none"/></bsdf></shape>
  <emitter type="point"><point name="position" value="0 4 0"/><spectrum name="intensity" value="5"/></emitter>
</scene>
"#;

const PART: &str = "<scene version=\"3.0.0\"><shape type=\"cube\" id=\"c\"/></scene>\n";

/// A bent grid of 6 × 6 vertices with everything an OBJ file can have.
fn mesh() -> String {
    let mut text = String::from("# a grid\nmtllib a.mtl\no grid\n");
    for i in 0..36 {
        let (x, y) = (i % 6, i / 6);
        text += &format!("v {x}.5 {} {y}.25\nvt 0.{x} 0.{y}\nvn 0 1 0\n", x * y);
    }
    text += "usemtl a\ns 1\n";
    for i in (0..30).filter(|i| i % 6 != 5) {
        let (a, b, c, d) = (i + 1, i + 2, i + 8, i + 7);
        text += &match i % 3 {
            0 => format!("f {a}/{a}/{a} {b}/{b}/{b} {c}/{c}/{c} {d}/{d}/{d}\n"),
            1 => format!("f {a}/{a}/{a} {b}/{b}/{b} {c}/{c}/{c}\nf -36/-36/-36 {c}/{c}/{c} {d}/{d}/{d}\n"),
            _ => format!("f {a}/{a}/{a} {b}/{b}/{b} {c}/{c}/{c} {d}/{d}/{d} {a}/{a}/{a}\n"),
        };
    }
    text
}

fn write(folder: &Path, name: &str, bytes: &[u8]) {
    std::fs::write(folder.join(name), bytes).expect("a writable folder");
}

/// Loads `scene.xml` of a folder under guard; the rendered message if it is refused.
fn outcome(folder: &Path, what: &str) -> Result<(), String> {
    let path = folder.join("scene.xml");
    guarded(what, move || match load(&path, &[]) {
        Ok(loaded) => {
            for w in &loaded.warnings {
                let shown = render(w);
                assert_has_place("a warning", &shown, &[".xml", ".obj"]);
            }
            Ok(())
        }
        Err(e) => Err(render(&e)),
    })
}

#[test]
fn a_thousand_broken_scenes() {
    let folder = folder("broken_scenes");
    write(&folder, "part.xml", PART.as_bytes());
    write(&folder, "mesh.obj", mesh().as_bytes());
    write(&folder, "scene.xml", SCENE.as_bytes());
    assert_eq!(outcome(&folder, "the whole scene"), Ok(()));
    let mut random = Random(20_261_121);
    let mut refused = 0;
    for i in 0..1000 {
        let mut bytes = SCENE.as_bytes().to_vec();
        for _ in 0..=random.below(3) {
            corrupt(&mut bytes, &mut random, PIECES);
        }
        write(&folder, "scene.xml", &bytes);
        let what = format!("scene {i}: {}", String::from_utf8_lossy(&bytes));
        if let Err(shown) = outcome(&folder, &what) {
            assert_has_place(&what, &shown, &["scene.xml", "part.xml", "mesh.obj"]);
            refused += 1;
        }
    }
    assert!(refused > 500, "only {refused} of 1000 were refused: are they broken at all?");
}

#[test]
fn a_thousand_broken_meshes() {
    let folder = folder("broken_meshes");
    write(&folder, "part.xml", PART.as_bytes());
    write(&folder, "scene.xml", SCENE.as_bytes());
    let mut random = Random(4_711);
    let (mut refused, mut read) = (0, 0);
    for i in 0..1000 {
        let mut bytes = mesh().into_bytes();
        for _ in 0..=random.below(4) {
            corrupt(&mut bytes, &mut random, LINES);
        }
        write(&folder, "mesh.obj", &bytes);
        let what = format!("mesh {i}: {}", String::from_utf8_lossy(&bytes));
        match outcome(&folder, &what) {
            Ok(()) => read += 1,
            Err(shown) => {
                assert_has_place(&what, &shown, &["mesh.obj"]);
                refused += 1;
            }
        }
    }
    assert!(refused > 50 && read > 50, "{refused} refused, {read} read");
}

fn refused(what: &str, text: String) {
    let shown = guarded(what, move || {
        load_str("big.xml", &text, &[]).map(|_| ()).map_err(|e: SceneError| render(&e))
    });
    assert_has_place(what, &shown.expect_err(what), &["big.xml"]);
}

#[test]
fn too_much_of_anything_is_refused_in_time() {
    refused("deep", "<scene>".to_owned() + &"<shape type='a'>".repeat(100_000));
    refused("deep and closed", "<a>".repeat(100_000) + &"</a>".repeat(100_000));
    let attributes: String = (0..100_000).map(|i| format!("a{i}='>' ")).collect();
    refused("attributes", format!("<scene {attributes}/>"));
    let names: String = (0..20_000).map(|i| format!("<shape xmlns:a{i}='b'>")).collect();
    refused("namespaces", format!("<scene>{names}"));
    refused("a long line", format!("<scene version='3.0.0'>{}<oops/></scene>", " ".repeat(1 << 20)));
    refused("a long name", format!("<scene version='3.0.0'><{}/></scene>", "é".repeat(1 << 19)));
    refused("a long type", format!("<scene version='3.0.0'><shape type='{}'/></scene>", "x".repeat(1 << 20)));
    let doubling: String =
        (1..60).map(|i| format!("<default name='v{i}_' value='$v{}_$v{}_'/>", i - 1, i - 1)).collect();
    refused(
        "doubling",
        format!("<scene version='3.0.0'><default name='v0_' value='xxxxxxxxxx'/>{doubling}</scene>"),
    );
    let laughs = "<!DOCTYPE a [<!ENTITY b 'ha'><!ENTITY c '&b;&b;'>]><scene/>";
    refused("entities", laughs.into());
    let chain: String =
        (0..5000).map(|i| format!("<bsdf type='twosided' id='a{i}'><ref id='a{}'/></bsdf>", i + 1)).collect();
    refused(
        "a chain of references",
        format!("<scene version='3.0.0'>{chain}<bsdf type='diffuse' id='a5000'/></scene>"),
    );
}

#[test]
fn includes_are_bounded() {
    let folder = folder("includes");
    let include = |name: &str| format!("<include filename=\"{name}\"/>");
    let scene = |body: &str| format!("<scene version=\"3.0.0\">\n{body}</scene>");
    let expect = |what: &str, words: &str| {
        let shown = outcome(&folder, what).expect_err(what);
        assert_has_place(what, &shown, &[".xml"]);
        assert!(shown.contains(words), "{what}: {shown}");
    };
    write(&folder, "scene.xml", scene(&include("./scene.xml")).as_bytes());
    expect("itself", "includes itself");
    write(&folder, "scene.xml", scene(&include("a.xml")).as_bytes());
    write(&folder, "a.xml", scene(&include("b.xml")).as_bytes());
    write(&folder, "b.xml", scene(&include("../includes/a.xml")).as_bytes());
    expect("a circle", "includes itself");
    for i in 0..60 {
        write(&folder, &format!("d{i}.xml"), scene(&include(&format!("d{}.xml", i + 1))).as_bytes());
    }
    write(&folder, "scene.xml", scene(&include("d0.xml")).as_bytes());
    expect("deep", "32 within each other");
    for i in 0..20 {
        let twice = include(&format!("t{}.xml", i + 1)).repeat(2);
        write(&folder, &format!("t{i}.xml"), scene(&twice).as_bytes());
    }
    write(&folder, "t20.xml", scene("").as_bytes());
    write(&folder, "scene.xml", scene(&include("t0.xml")).as_bytes());
    expect("two to the twentieth", "4096 includes");
    for missing in ["nothing.xml", ".", "/dev/zero", ""] {
        write(&folder, "scene.xml", scene(&include(missing)).as_bytes());
        expect("not a file", "scene.xml:2");
    }
}

#[test]
fn the_guard_can_fail() {
    let caught = std::panic::catch_unwind(|| {
        guarded("too much", || drop(std::hint::black_box(vec![1_u8; MEMORY + 1])))
    });
    assert!(caught.is_err(), "the allocator must notice");
    let caught = std::panic::catch_unwind(|| guarded("a panic", || panic!("on purpose")));
    assert!(caught.is_err());
}
