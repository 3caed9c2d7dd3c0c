//! The panel's side of the loop: egui's input and output, and the figures that it shows.

use std::time::{Duration, Instant};

use winit::event::WindowEvent;
use winit::window::Window;

use crate::app::plan;
use crate::app::view::screen::{Screen, Triangles};
use crate::app::view::viewer::Viewer;
use crate::client::settings::FilmCounts;
use crate::client::window::panel::{self, Action, Controls, Effect, Readout, Show};
use crate::tracer::effects::{self, refusal};

/// The panel's figures are drawn anew this often.
const REFRESH: Duration = Duration::from_millis(200);

/// A message stands over the picture for this long.
const MESSAGE: Duration = Duration::from_secs(5);

/// egui and what it last wanted drawn.
pub struct Ui {
    context: egui::Context,
    state: egui_winit::State,
    /// For the overlay.
    pub triangles: Triangles,
    /// The pointer, in points.
    pointer: Option<egui::Pos2>,
    /// egui must run again by then.
    due: Instant,
    /// The last message for the user, and until when it stands over the picture.
    message: Option<(String, Instant)>,
    /// It was drawn last time.
    told: bool,
}

impl Ui {
    /// For this window.
    pub fn new(window: &Window) -> Self {
        let context = egui::Context::default();
        let scale = Some(window.scale_factor() as f32);
        let state = egui_winit::State::new(
            context.clone(),
            egui::ViewportId::ROOT,
            window,
            scale,
            window.theme(),
            Some(4096),
        );
        Self {
            context,
            state,
            triangles: Triangles::default(),
            pointer: None,
            due: Instant::now(),
            message: None,
            told: false,
        }
    }

    /// Gives an event to egui; true when the panel has it and the picture must not react.
    pub fn on_event(&mut self, window: &Window, event: &WindowEvent) -> bool {
        let keyboard = matches!(event, WindowEvent::KeyboardInput { .. });
        if keyboard && !self.context.egui_wants_keyboard_input() {
            // egui would take Tab for moving its focus.
            return false;
        }
        match event {
            WindowEvent::CursorMoved { position, .. } => {
                let at = position
                    .to_logical::<f32>(f64::from(egui_winit::pixels_per_point(&self.context, window)));
                self.pointer = Some(egui::pos2(at.x, at.y));
            }
            WindowEvent::CursorLeft { .. } => self.pointer = None,
            _ => {}
        }
        let response = self.state.on_window_event(window, event);
        if response.repaint {
            self.due = Instant::now();
        }
        match event {
            // egui answers for where the pointer was when it ran last, which may be long ago on a slow device.
            WindowEvent::MouseInput { .. } | WindowEvent::MouseWheel { .. } => {
                response.consumed || self.is_under_pointer()
            }
            _ => response.consumed,
        }
    }

    /// The pointer is over the panel, the list of keys or an open menu.
    fn is_under_pointer(&self) -> bool {
        let layer = self.pointer.and_then(|at| self.context.layer_id_at(at));
        layer.is_some_and(|layer| layer.order != egui::Order::Background)
    }

    /// Puts text on the clipboard.
    pub fn copy(&mut self, text: String) {
        self.state.set_clipboard_text(text);
    }

    /// A message for the user.
    pub fn say(&mut self, text: String) {
        let now = Instant::now();
        (self.message, self.due) = (Some((text, now + MESSAGE)), now);
    }

    /// A message stands over the picture, or stood there when it was drawn last.
    fn tells(&self) -> bool {
        self.told || self.message(Instant::now()).is_some()
    }

    /// The message that stands over the picture now.
    fn message(&self, now: Instant) -> Option<&str> {
        self.message.as_ref().filter(|(_, until)| now < *until).map(|(text, _)| text.as_str())
    }

    /// Asks for the panel to be drawn anew.
    pub fn refresh(&mut self) {
        self.due = Instant::now();
    }

    /// True when egui must run.
    pub fn is_due(&self, now: Instant) -> bool {
        now >= self.due
    }

    /// When egui must run next.
    pub fn due(&self) -> Instant {
        self.due
    }

    /// Runs egui; returns what the user asked for.
    fn run(&mut self, window: &Window, readout: &Readout, controls: &mut Controls) -> Vec<Action> {
        let input = self.state.take_egui_input(window);
        let mut actions = Vec::new();
        let output = self.context.run_ui(input, |ui| actions.extend(panel::show(ui, readout, controls)));
        self.state.handle_platform_output(window, output.platform_output);
        self.triangles.textures.append(output.textures_delta);
        self.triangles.primitives = self.context.tessellate(output.shapes, output.pixels_per_point);
        self.triangles.pixels_per_point = output.pixels_per_point;
        let delay = output.viewport_output.values().map(|v| v.repaint_delay).min().unwrap_or(REFRESH);
        self.due = Instant::now() + delay.min(REFRESH);
        actions
    }
}

impl Viewer {
    /// Something of egui stands over the picture: panel, keys or a message.
    pub fn has_overlay(&self) -> bool {
        self.controls.visible
            || self.controls.help
            || self.controls.show != Show::Picture
            || self.ui.as_ref().is_some_and(Ui::tells)
    }

    /// It must be drawn anew.
    pub fn panel_due(&self, now: Instant) -> bool {
        self.has_overlay() && self.ui.as_ref().is_some_and(|ui| ui.is_due(now))
    }

    /// Runs the panel if it is due, and does what the user asks for.
    pub fn run_panel(&mut self, now: Instant) {
        if !self.panel_due(now) {
            return;
        }
        let readout = self.readout(now);
        let before = (self.controls.settings.clone(), self.controls.filter);
        let (Some(ui), Some(screen)) = (&mut self.ui, &self.screen) else { return };
        ui.told = readout.message.is_some();
        let actions = ui.run(&screen.window().clone(), &readout, &mut self.controls);
        if before != (self.controls.settings.clone(), self.controls.filter) {
            self.settings_changed = true;
        }
        self.aim();
        self.actions.extend(actions);
    }

    /// The plan as the panel lists it.
    pub fn effects(&mut self) -> Vec<Effect> {
        let now = (self.plan.run.integrator, self.controls.settings.clone());
        if let Some((key, effects)) = &self.listed
            && *key == now
        {
            return effects.clone();
        }
        let (run, forced) = (&self.plan.run, self.user.forced());
        let line = |entry: plan::PlannedEffect| {
            let can_switch = entry.effect.map_or(
                entry.listed.as_ref().is_some_and(|listed| listed.can_switch),
                |effect| {
                    let is_forced = forced.iter().any(|forced| forced.effect == effect);
                    let can_add = effects::force_on(&mut self.user.desc().clone(), effect).is_ok();
                    is_forced || entry.on && refusal(effect, run.integrator).is_none() || !entry.on && can_add
                },
            );
            let place = entry.place.map_or(String::new(), |place| format!(" ({place})"));
            Effect { name: entry.name, on: entry.on, reason: entry.reason + &place, can_switch, cost: None }
        };
        let effects: Vec<Effect> = self.list().into_iter().map(line).collect();
        self.listed = Some((now, effects.clone()));
        effects
    }

    /// The plan as it is now.
    pub fn list(&self) -> Vec<plan::PlannedEffect> {
        plan::plan(self.user.desc(), &self.plan.run, &self.controls.settings)
    }

    /// What the panel shows.
    fn readout(&mut self, now: Instant) -> Readout {
        let spec = self.spec();
        let [width, height] = spec.padded_extent().map(u64::from);
        let counts: FilmCounts = self.counts();
        let texels = width * height;
        let lod = |samples: u64| (samples > 0).then(|| 0.5 * (texels as f64 / samples as f64).log2() as f32);
        let traced = self.session.traced();
        let [traced_per_second, rasterised_per_second] = self.figures.rates(traced);
        let statistics = &self.figures.statistics;
        let device = self.screen.as_ref().and_then(Screen::gpu).map(|gpu| gpu.info().clone());
        Readout {
            device: device.map_or(String::new(), |d| match d.driver.contains(&d.name) {
                true => d.driver,
                false => format!("{} ({})", d.name, d.driver),
            }),
            plan: self.plan.cores.clone(),
            method: self.plan.run.integrator.name(),
            reason: self.plan.run.auto.as_ref().map_or(String::new(), |chosen| chosen.reason.clone()),
            extent: self.size,
            detail: self.clock.repainted.2,
            counts,
            texels,
            traced_per_second,
            rasterised_per_second,
            lods: [lod(counts.camera_samples), lod(counts.light_samples)],
            ring: self.session.fill(),
            passes: self.figures.passes.clone(),
            frames: statistics.frames(),
            percentiles: statistics.percentiles(),
            budget: self.pacer.budget(),
            edit_latency: statistics.edit_latency(),
            edit_latency_p95: statistics.edit_latency_p95(),
            threads: self.session.threads(),
            elapsed: self.session.elapsed(),
            message: self.ui.as_ref().and_then(|ui| ui.message(now)).map(str::to_owned),
            selection: self.user.selection(),
            effects: self.priced_effects(),
            costs: self.costs.state(),
            error: self.error(),
            overlay: self.overlay(now),
            left_out: self.plan.run.left_out().collect(),
            camera: self.user.camera_words(),
            fov: self.user.history.pose().fov,
        }
    }
}
