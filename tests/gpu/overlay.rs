//! The panel over the picture: egui's triangles on a real window.

use std::time::Duration;

use crate::common::assert_silent;
use crate::x11_window::Window;
use egui::{Color32, Context, RawInput, Rect, TexturesDelta, pos2, vec2};
use pointillist::client::window::panel_renderer::PanelRenderer;
use pointillist::gpu::{CallFaults, DeviceChoice, GpuError, GpuOptions, Readiness, Swapchain};

const SIZE: [u32; 2] = [200, 120];

fn open(window: &Window) -> Swapchain {
    let options = GpuOptions { validation: true, ..GpuOptions::default() };
    Swapchain::open(&DeviceChoice::Best, options, window.handles(), SIZE, &CallFaults::default())
        .expect("a swapchain")
}

/// What egui wants drawn.
type Output = (TexturesDelta, Vec<egui::ClippedPrimitive>);

fn ui(context: &Context, contents: impl FnMut(&mut egui::Ui)) -> Output {
    let size = vec2(SIZE[0] as f32, SIZE[1] as f32);
    let input =
        RawInput { screen_rect: Some(Rect::from_min_size(pos2(0.0, 0.0), size)), ..RawInput::default() };
    let output = context.run_ui(input, contents);
    let triangles = context.tessellate(output.shapes, output.pixels_per_point);
    (output.textures_delta, triangles)
}

fn draw(swapchain: &mut Swapchain, overlay: &mut PanelRenderer, (textures, triangles): Output) {
    let outcome = try_draw(swapchain, overlay, (textures, triangles));
    outcome.expect("the panel");
}

fn try_draw(
    swapchain: &mut Swapchain,
    overlay: &mut PanelRenderer,
    (textures, triangles): Output,
) -> Result<(), GpuError> {
    assert_eq!(swapchain.acquire(Duration::from_secs(10)).expect("acquire"), Readiness::Ready);
    let gpu = swapchain.gpu().clone();
    let mut frame = gpu.begin()?;
    overlay.draw(swapchain, &mut frame, textures, &triangles, 1.0)?;
    swapchain.present(frame).map(|_| ())
}

fn fill(ui: &egui::Ui, rect: Rect, color: Color32) {
    ui.painter().rect_filled(rect, 0.0, color);
}

#[test]
fn the_panel_covers_the_picture() {
    let window = Window::new(SIZE);
    let mut swapchain = open(&window);
    let gpu = swapchain.gpu().clone();
    let mut overlay = PanelRenderer::new(&swapchain).expect("an overlay");
    let context = Context::default();
    context.set_pixels_per_point(1.0);
    let left = Rect::from_min_size(pos2(10.0, 20.0), vec2(30.0, 40.0));
    let right = Rect::from_min_size(pos2(100.0, 20.0), vec2(30.0, 40.0));
    let output = ui(&context, |ui| {
        fill(ui, left, Color32::from_rgb(200, 100, 50));
        fill(ui, right, Color32::from_rgba_unmultiplied(255, 255, 255, 128));
    });
    draw(&mut swapchain, &mut overlay, output);
    let mut wanted = vec![[0_u8; 3]; (SIZE[0] * SIZE[1]) as usize];
    for (x0, color) in [(10, [200, 100, 50]), (100, [128; 3])] {
        for y in 20..60 {
            for x in x0..x0 + 30 {
                wanted[(y * SIZE[0] + x) as usize] = color;
            }
        }
    }
    // The renderer computes with a power of 2.2 to and fro: within two steps, and edges are feathered.
    let near = |got: &[[u8; 3]]| {
        let inner = |i: usize| {
            let (x, y) = (i as u32 % SIZE[0], i as u32 / SIZE[0]);
            let inside = |x0: u32| (x0 + 2..x0 + 28).contains(&x) && (22..58).contains(&y);
            let outside = !(18..=62).contains(&y);
            inside(10) || inside(100) || outside
        };
        (0..wanted.len()).filter(|i| inner(*i)).all(|i| (0..3).all(|c| got[i][c].abs_diff(wanted[i][c]) <= 2))
    };
    window.shows_what(SIZE, near);
    assert_silent(&gpu);
}

/// Text needs the font's texture, which grows by parts as new letters come, and is freed with the overlay; the window
/// is resized, loses its surface and is hidden meanwhile.
#[test]
fn textures_outlive_what_happens_to_the_window() {
    let window = Window::new(SIZE);
    let mut swapchain = open(&window);
    let mut gpu = swapchain.gpu().clone();
    let mut overlay = PanelRenderer::new(&swapchain).expect("an overlay");
    let context = Context::default();
    let mut own = None;
    for i in 0..59_u32 {
        match i {
            20 => {
                let lost = "acquire,0,1,ERROR_SURFACE_LOST_KHR".parse().expect("a fault");
                swapchain.gpu().faults().plan(lost);
                let outcome = swapchain.acquire(Duration::ZERO).expect("acquire");
                assert_eq!(outcome, Readiness::SurfaceLost);
                swapchain.replace_surface(window.handles()).expect("a surface");
            }
            40 => {
                // Another device: the overlay brings its textures along.
                assert_silent(&gpu);
                drop(swapchain);
                swapchain = open(&window);
                gpu = swapchain.gpu().clone();
            }
            _ => {}
        }
        let size = [SIZE[0] + i % 7, SIZE[1] - i % 5];
        window.resize(size);
        swapchain.resize(size);
        let letter = char::from_u32('!' as u32 + i).expect("a letter");
        if i % 10 == 3 {
            let image = egui::ColorImage::filled([4, 4], Color32::from_gray(i as u8));
            own = Some(context.load_texture("own", image, egui::TextureOptions::NEAREST));
        } else if i % 10 == 8 {
            own = None;
        }
        let output = ui(&context, |ui| {
            ui.label(format!("{letter} {i}"));
            if let Some(own) = &own {
                ui.image(own);
            }
        });
        if i % 6 == 5 {
            // Hidden: the textures are taken all the same.
            swapchain.resize([0, 0]);
            assert_eq!(swapchain.acquire(Duration::ZERO).expect("acquire"), Readiness::Hidden);
            let mut frame = gpu.begin().expect("a frame");
            overlay.draw(&mut swapchain, &mut frame, output.0, &output.1, 1.0).expect("nothing is drawn");
            swapchain.present(frame).expect("a frame");
        } else {
            draw(&mut swapchain, &mut overlay, output);
        }
    }
    // Grey letters on black; the window's own background is magenta.
    window.shows_what([SIZE[0], 100], |pixels| {
        pixels.iter().any(|p| p[1] > 100) && pixels.iter().all(|p| p[1].abs_diff(p[0]) < 8)
    });
    // Nothing at all is drawn as well as something.
    draw(&mut swapchain, &mut overlay, (TexturesDelta::default(), Vec::new()));
    drop(overlay);
    drop(swapchain);
    assert_silent(&gpu);
}

#[test]
fn a_lost_device_is_an_error_of_the_panel_too() {
    let window = Window::new(SIZE);
    let mut swapchain = open(&window);
    let gpu = swapchain.gpu().clone();
    let mut overlay = PanelRenderer::new(&swapchain).expect("an overlay");
    let context = Context::default();
    let output = ui(&context, |ui| drop(ui.label("before")));
    draw(&mut swapchain, &mut overlay, output);
    let output = ui(&context, |ui| drop(ui.label("after")));
    gpu.lose_after(0);
    let error = try_draw(&mut swapchain, &mut overlay, output).expect_err("the device is lost");
    assert!(error.is_device_lost(), "{error}");
    assert_silent(&gpu);
    // The window's images first, the panel last: everything waits for everything.
    drop(swapchain);
    drop(gpu);
    drop(overlay);
}
