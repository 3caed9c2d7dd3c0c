//! Windows: what the screen shows, and what happens when windows change or go.

use std::sync::Arc;
use std::time::Duration;

use crate::common::assert_silent;
use crate::support::xserver::Server;
use crate::x11_window::Window;
use pointillist::gpu::{
    Buffer, BufferUse, CallFaults, ColorOutput, CopyFilter, CopyRegion, DeviceCall, DeviceChoice, Gpu,
    GpuError, GpuOptions, Image, Readiness, Swapchain, TexelFormat,
};
use pointillist::math::random::Random;
use raw_window_handle::{RawDisplayHandle, WindowsDisplayHandle};

const PATIENCE: Duration = Duration::from_secs(10);

fn open(window: &Window, extent: [u32; 2]) -> Swapchain {
    let options = GpuOptions { validation: true, ..GpuOptions::default() };
    Swapchain::open(&DeviceChoice::Best, options, window.handles(), extent, &CallFaults::default())
        .expect("a swapchain")
}

/// A picture of noise, and its bytes.
fn noise(gpu: &Arc<Gpu>, [width, height]: [u32; 2], seed: u64) -> (Image, Vec<[u8; 3]>) {
    let mut numbers = Random(seed);
    let pixels: Vec<[u8; 3]> =
        (0..width * height).map(|_| [(); 3].map(|()| (numbers.f32() * 256.0) as u8)).collect();
    let mut image = Image::new(gpu, "noise", TexelFormat::Rgba8, [width, height]).expect("an image");
    let bytes: Vec<u8> = pixels.iter().flat_map(|[r, g, b]| [*r, *g, *b, 255]).collect();
    let mut buffer = Buffer::new(gpu, "noise", BufferUse::Upload, bytes.len()).expect("a buffer");
    buffer.mapped_mut().copy_from_slice(&bytes);
    let mut frame = gpu.begin().expect("a frame");
    frame.cmd().copy_from_buffers(&[&buffer], &mut image);
    frame.submit().expect("submit");
    (image, pixels)
}

fn ready(swapchain: &mut Swapchain) {
    assert_eq!(swapchain.acquire(PATIENCE).expect("acquire"), Readiness::Ready);
}

/// Shows a picture once.
fn show(swapchain: &mut Swapchain, picture: &mut Image) {
    ready(swapchain);
    let gpu = swapchain.gpu().clone();
    let mut frame = gpu.begin().expect("a frame");
    let whole = CopyRegion::whole(picture.extent(0));
    swapchain.draw(&mut frame, picture, &[whole], CopyFilter::Nearest, true);
    swapchain.present(frame).expect("present");
}

/// What a window of `size` shows of a picture of `extent`: its left top, black around it.
fn cropped(pixels: &[[u8; 3]], [width, height]: [u32; 2], size: [u32; 2]) -> Vec<[u8; 3]> {
    let texel = |x, y| if x < width && y < height { pixels[(y * width + x) as usize] } else { [0; 3] };
    (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| texel(x, y))).collect()
}

#[test]
fn the_screen_shows_the_bytes_of_the_picture() {
    let size = [64, 48];
    let window = Window::new(size);
    let mut swapchain = open(&window, size);
    let gpu = swapchain.gpu().clone();
    assert_eq!(swapchain.extent(), Some(size));
    assert_eq!((swapchain.output(), swapchain.outputs()), (ColorOutput::Sdr, vec![ColorOutput::Sdr]));
    assert!(!swapchain.set_output(ColorOutput::Hdr10), "Xvfb has no such thing");
    assert_eq!(swapchain.most_layers(), 1, "Mesa's surfaces of X windows have no second layer");
    assert!(swapchain.set_layers(1) && !swapchain.set_layers(2) && !swapchain.set_layers(0));
    for (seed, extent) in [(1, size), (2, [64, 20]), (3, [31, 48]), (4, [1, 1]), (5, [100, 90]), (6, [80, 7])]
    {
        let (mut picture, pixels) = noise(&gpu, extent, seed);
        show(&mut swapchain, &mut picture);
        window.shows(size, &cropped(&pixels, extent, size));
    }
    // A frame that is given up leaves the image to the next one.
    let (mut picture, pixels) = noise(&gpu, size, 7);
    ready(&mut swapchain);
    let mut frame = gpu.begin().expect("a frame");
    let whole = CopyRegion::whole(picture.extent(0));
    swapchain.draw(&mut frame, &mut picture, &[whole], CopyFilter::Nearest, true);
    drop(frame);
    assert_eq!(swapchain.acquire(Duration::ZERO).expect("acquire"), Readiness::Ready);
    swapchain.present(gpu.begin().expect("a frame")).expect("present");
    window.shows(size, &pixels);
    // A frame without a picture is black.
    ready(&mut swapchain);
    swapchain.present(gpu.begin().expect("a frame")).expect("present");
    window.shows(size, &cropped(&[], [0, 0], size));
    assert_silent(&gpu);
}

#[test]
fn images_follow_the_window() {
    let window = Window::new([50, 40]);
    let mut swapchain = open(&window, [50, 40]);
    let gpu = swapchain.gpu().clone();
    let mut numbers = Random(7);
    let (mut picture, pixels) = noise(&gpu, [60, 60], 1);
    for i in 0..200 {
        let size = [(); 2].map(|()| 1 + (numbers.f32() * 70.0) as u32);
        window.resize(size);
        // The window system may be ahead of the program's events, or behind.
        if i % 3 != 0 {
            swapchain.resize(size);
        }
        show(&mut swapchain, &mut picture);
        if i % 40 == 0 {
            show(&mut swapchain, &mut picture);
            assert_eq!(swapchain.extent(), Some(size));
            window.shows(size, &cropped(&pixels, [60, 60], size));
        }
    }
    assert_silent(&gpu);
}

#[test]
fn the_smallest_windows() {
    let window = Window::new([1, 1]);
    let mut swapchain = open(&window, [1, 1]);
    let gpu = swapchain.gpu().clone();
    let (mut picture, pixels) = noise(&gpu, [3, 3], 1);
    show(&mut swapchain, &mut picture);
    window.shows([1, 1], &pixels[..1]);
    swapchain.resize([0, 0]);
    for _ in 0..3 {
        assert_eq!(swapchain.acquire(PATIENCE).expect("acquire"), Readiness::Hidden);
        assert_eq!(swapchain.extent(), None);
        // Frames may go on without a window.
        let mut frame = gpu.begin().expect("a frame");
        let whole = CopyRegion::whole(picture.extent(0));
        swapchain.draw(&mut frame, &mut picture, &[whole], CopyFilter::Nearest, true);
        swapchain.present(frame).expect("present");
    }
    swapchain.resize([1, 1]);
    show(&mut swapchain, &mut picture);
    assert_eq!(swapchain.extent(), Some([1, 1]));
    drop(swapchain);
    // Hidden from the first moment.
    let mut swapchain = open(&window, [0, 0]);
    assert_eq!(swapchain.extent(), None);
    assert_eq!(swapchain.acquire(PATIENCE).expect("acquire"), Readiness::Hidden);
    swapchain.resize([1, 1]);
    ready(&mut swapchain);
    assert_silent(&gpu);
    assert_silent(swapchain.gpu());
}

#[test]
fn lost_surfaces_are_replaced() {
    let size = [40, 30];
    let window = Window::new(size);
    let mut swapchain = open(&window, size);
    let gpu = swapchain.gpu().clone();
    let (mut picture, pixels) = noise(&gpu, size, 1);
    let fault = |text: &str| text.parse().expect("a fault");
    swapchain.gpu().faults().plan(fault("acquire,0,1,ERROR_OUT_OF_DATE_KHR"));
    show(&mut swapchain, &mut picture);
    for _ in 0..3 {
        swapchain.gpu().faults().plan(fault("acquire,0,1,ERROR_SURFACE_LOST_KHR"));
        assert_eq!(swapchain.acquire(PATIENCE).expect("acquire"), Readiness::SurfaceLost);
        assert_eq!(swapchain.acquire(PATIENCE).expect("acquire"), Readiness::SurfaceLost);
        swapchain.replace_surface(window.handles()).expect("a surface");
        show(&mut swapchain, &mut picture);
        window.shows(size, &pixels);
    }
    drop(swapchain);
    assert_silent(&gpu);
}

/// A window that another program destroys is a lost surface, not an error, and a new window can take its place.
#[test]
fn destroyed_windows_are_lost_surfaces() {
    let size = [40, 30];
    let mut window = Window::new(size);
    let mut swapchain = open(&window, size);
    let gpu = swapchain.gpu().clone();
    let (mut picture, pixels) = noise(&gpu, size, 1);
    show(&mut swapchain, &mut picture);
    window.destroy();
    let mut lost = false;
    for _ in 0..20 {
        match swapchain.acquire(Duration::from_millis(20)).expect("acquire") {
            Readiness::Ready => {
                let mut frame = gpu.begin().expect("a frame");
                let whole = CopyRegion::whole(picture.extent(0));
                swapchain.draw(&mut frame, &mut picture, &[whole], CopyFilter::Nearest, true);
                swapchain.present(frame).expect("present");
            }
            Readiness::SurfaceLost => lost = true,
            Readiness::Busy | Readiness::Hidden => {}
        }
    }
    assert!(lost, "the driver never said that the surface is gone");
    window.create(size);
    swapchain.replace_surface(window.handles()).expect("a surface");
    show(&mut swapchain, &mut picture);
    window.shows(size, &pixels);
    assert_silent(&gpu);
}

/// Shows a picture whatever the window system says, as the viewer does: errors but a lost device are tried again.
fn show_in_the_end(swapchain: &mut Swapchain, window: &Window, picture: &mut Image) -> Vec<GpuError> {
    let gpu = swapchain.gpu().clone();
    let mut errors = Vec::new();
    while errors.len() < 20 {
        match swapchain.acquire(PATIENCE) {
            Ok(Readiness::Ready) => {}
            Ok(Readiness::SurfaceLost) => {
                errors.extend(swapchain.replace_surface(window.handles()).err());
                continue;
            }
            Ok(_) => continue,
            Err(error) => {
                errors.push(error);
                continue;
            }
        }
        let mut frame = gpu.begin().expect("a frame");
        let whole = CopyRegion::whole(picture.extent(0));
        swapchain.draw(&mut frame, picture, &[whole], CopyFilter::Nearest, true);
        swapchain.present(frame).expect("present");
        if !swapchain.has_failed() {
            break;
        }
    }
    errors
}

/// Every call of the window system fails with every result that it may have, once and several times in a row: the next attempts show the
/// picture, and nothing is used wrongly or left behind.
#[test]
fn every_call_of_the_window_may_fail() {
    let size = [40, 30];
    let window = Window::new(size);
    let mut swapchain = open(&window, size);
    let gpu = swapchain.gpu().clone();
    let memory = ["ERROR_OUT_OF_HOST_MEMORY", "ERROR_OUT_OF_DEVICE_MEMORY"];
    let gone =
        ["ERROR_OUT_OF_DATE_KHR", "ERROR_SURFACE_LOST_KHR", "ERROR_FULL_SCREEN_EXCLUSIVE_MODE_LOST_EXT"];
    let creation =
        ["ERROR_INITIALIZATION_FAILED", "ERROR_NATIVE_WINDOW_IN_USE_KHR", "ERROR_SURFACE_LOST_KHR"];
    let cases = [
        ("surface", [&memory[..], &creation[..2]].concat()),
        ("swapchain", [&memory[..], &creation].concat()),
        ("acquire", [&memory[..], &gone, &["NOT_READY", "SUBOPTIMAL_KHR", "ERROR_UNKNOWN"]].concat()),
        ("present", [&memory[..], &gone, &["SUBOPTIMAL_KHR", "ERROR_UNKNOWN"]].concat()),
    ];
    let mut seed = 0;
    for (call, results) in cases {
        for result in results {
            for times in [1, 3] {
                seed += 1;
                let (mut picture, pixels) = noise(&gpu, size, seed);
                let plan = |text: String| swapchain.gpu().faults().plan(text.parse().expect("a fault"));
                plan(format!("{call},0,{times},{result}"));
                match call {
                    // Only then is it made at all.
                    "surface" => plan("acquire,0,1,ERROR_SURFACE_LOST_KHR".into()),
                    "swapchain" => plan("acquire,0,1,ERROR_OUT_OF_DATE_KHR".into()),
                    _ => {}
                }
                let errors = show_in_the_end(&mut swapchain, &window, &mut picture);
                // Those that the window's images follow by themselves are none.
                let is_followed = gone.contains(&result) || ["NOT_READY", "SUBOPTIMAL_KHR"].contains(&result);
                let wanted = if is_followed { 0 } else { times };
                assert_eq!(errors.len(), wanted, "{call} {result}: {errors:?}");
                assert!(errors.iter().all(|error| format!("{error:?}").contains(result)), "{errors:?}");
                for _ in 0..4 {
                    assert!(show_in_the_end(&mut swapchain, &window, &mut picture).is_empty());
                }
                window.shows(size, &pixels);
            }
        }
    }
    assert_silent(&gpu);
}

/// Some drivers call all images suboptimal: they are not made anew in every frame for that, and follow the window all the same.
#[test]
fn suboptimal_images_are_not_made_anew_all_the_time() {
    let window = Window::new([40, 30]);
    let mut swapchain = open(&window, [40, 30]);
    let gpu = swapchain.gpu().clone();
    let (mut picture, pixels) = noise(&gpu, [40, 40], 1);
    swapchain.gpu().faults().plan("present,0,1000000,SUBOPTIMAL_KHR".parse().expect("a fault"));
    for size in [[40, 30], [30, 40]] {
        window.resize(size);
        for _ in 0..20 {
            show(&mut swapchain, &mut picture);
        }
        assert_eq!(swapchain.extent(), Some(size));
        window.shows(size, &cropped(&pixels, [40, 40], size));
    }
    let (made, shown) = (
        swapchain.gpu().faults().calls(DeviceCall::Swapchain),
        swapchain.gpu().faults().calls(DeviceCall::Present),
    );
    // The first ones, those of the second size, and what a slow machine may take longer than a second for.
    assert!(shown == 40 && made < 10, "{made} generations in {shown} frames");
    assert_silent(&gpu);
}

fn assert_lost<T>(outcome: Result<T, GpuError>, what: &str) {
    match outcome {
        Ok(_) => panic!("{what} did not notice"),
        Err(error) => assert!(error.is_device_lost(), "{what}: {error}"),
    }
}

/// A lost device is the same kind of error everywhere; what it owned can be dropped, in any state, and a new device
/// shows pictures in the same window.
#[test]
fn a_lost_device_can_be_replaced() {
    let size = [40, 30];
    let window = Window::new(size);
    for acquired in [false, true] {
        let mut swapchain = open(&window, size);
        let gpu = swapchain.gpu().clone();
        let (mut picture, _) = noise(&gpu, size, 1);
        gpu.lose_after(1);
        show(&mut swapchain, &mut picture);
        if acquired {
            ready(&mut swapchain);
        }
        let frame = gpu.begin().expect("a frame");
        let number = frame.submit();
        assert_lost(number, "submit");
        assert_lost(swapchain.acquire(PATIENCE), "acquire");
        assert_lost(gpu.begin(), "begin");
        assert_silent(&gpu);
        drop(picture);
        drop(swapchain);
        drop(gpu);
    }
    let mut swapchain = open(&window, size);
    let gpu = swapchain.gpu().clone();
    let (mut picture, pixels) = noise(&gpu, size, 2);
    show(&mut swapchain, &mut picture);
    window.shows(size, &pixels);
    // Lost between acquiring and presenting.
    ready(&mut swapchain);
    let mut frame = gpu.begin().expect("a frame");
    let whole = CopyRegion::whole(picture.extent(0));
    swapchain.draw(&mut frame, &mut picture, &[whole], CopyFilter::Nearest, true);
    gpu.lose_after(0);
    assert_lost(swapchain.present(frame), "present");
    assert_lost(gpu.wait(pointillist::gpu::FrameNumber::default()), "wait");
    assert_silent(&gpu);
}

/// Windows come one after the other, and whatever was made is dropped in any order.
#[test]
fn windows_come_and_go() {
    let size = [40, 30];
    let window = Window::new(size);
    for i in 0..8 {
        let mut swapchain = open(&window, size);
        let gpu = swapchain.gpu().clone();
        let (mut picture, pixels) = noise(&gpu, size, i);
        show(&mut swapchain, &mut picture);
        window.shows(size, &pixels);
        if i & 1 != 0 {
            ready(&mut swapchain); // and never presented
        }
        match i >> 1 {
            0 => drop((swapchain, picture)),
            1 => drop((picture, swapchain)),
            2 => {
                let other = Window::new_beside(&window, size);
                let mut second = open(&other, size);
                let (mut own, _) = noise(second.gpu(), size, 9);
                show(&mut second, &mut own);
                assert_silent(second.gpu());
                drop(swapchain);
                show(&mut second, &mut own);
                assert_silent(second.gpu());
            }
            _ => {
                // Dropped by the end of the scope, the window's images first.
                swapchain.resize([40, 30]);
            }
        }
        assert_silent(&gpu);
    }
}

/// What cannot be opened says why.
#[test]
fn impossible_windows_are_sentences() {
    let size = [40, 30];
    let window = Window::new(size);
    let options = GpuOptions { validation: true, ..GpuOptions::default() };
    let foreign = RawDisplayHandle::Windows(WindowsDisplayHandle::new());
    let handles = (foreign, window.handles().1);
    let error = Swapchain::open(&DeviceChoice::Best, options, handles, size, &CallFaults::default())
        .err()
        .expect("not here");
    assert!(matches!(error, GpuError::NoWindow(_)), "{error}");
    let none = DeviceChoice::Name("no such card".into());
    let error = Swapchain::open(&none, options, window.handles(), size, &CallFaults::default())
        .err()
        .expect("no such card");
    assert!(matches!(error, GpuError::NoMatch { .. }), "{error}");
}

/// The connection to the display ends: acquiring says so or fails, and nothing hangs.
#[test]
fn a_lost_display_ends_in_peace() {
    let size = [40, 30];
    let server = Server::start(800, 600);
    let window = Window::on(&server, size);
    let mut swapchain = open(&window, size);
    let gpu = swapchain.gpu().clone();
    let (mut picture, _) = noise(&gpu, size, 1);
    for _ in 0..3 {
        show(&mut swapchain, &mut picture);
    }
    drop(server);
    let mut gone = false;
    for _ in 0..20 {
        match swapchain.acquire(Duration::from_millis(20)) {
            Ok(Readiness::Ready) => {
                let mut frame = gpu.begin().expect("a frame");
                let whole = CopyRegion::whole(picture.extent(0));
                swapchain.draw(&mut frame, &mut picture, &[whole], CopyFilter::Nearest, true);
                gone |= swapchain.present(frame).is_err();
            }
            Ok(Readiness::SurfaceLost) => gone |= swapchain.replace_surface(window.handles()).is_err(),
            Ok(_) => {}
            Err(_) => gone = true,
        }
    }
    assert!(gone, "nobody noticed");
}
