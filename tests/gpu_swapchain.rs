//! Windows: what the screen shows, and what happens when windows change or go.

mod gpu_support;
#[path = "gpu_support/window.rs"]
mod window;

use std::sync::Arc;
use std::time::Duration;

use gpu_support::assert_silent;
use pointillist::gpu::{
    Access, DeviceChoice, Format, Frame, Gpu, GpuOptions, Image, ImageDesc, Readiness, Swapchain,
};
use window::Window;

const VALIDATED: GpuOptions = GpuOptions { validation: true, quads: false };

fn open(window: &Window, extent: [u32; 2]) -> Swapchain {
    Swapchain::open(&DeviceChoice::Best, VALIDATED, window.handles(), extent).expect("a swapchain")
}

#[test]
fn the_screen_shows_the_picture() {
    let window = Window::new(64, 48);
    let mut swapchain = open(&window, [64, 48]);
    let gpu = swapchain.gpu().clone();
    assert_eq!(swapchain.extent(), Some([64, 48]));
    assert_eq!(swapchain.acquire(Duration::from_secs(5)).expect("acquire"), Readiness::Ready);
    let frame = gpu.begin().expect("a frame");
    let number = swapchain.present(frame).expect("present");
    gpu.wait(number).expect("wait");
    std::thread::sleep(Duration::from_millis(100));
    window.sync();
    assert!(window.pixels(64, 48).iter().all(|p| *p == [0, 0, 0]), "{:?}", &window.pixels(64, 48)[..4]);
    println!("{}", swapchain.present_mode());
    assert_silent(&gpu);
}
