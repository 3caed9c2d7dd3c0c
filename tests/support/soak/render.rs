//! Renders of the soak: each of a scene by a method, with its counts checked at the end.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use pointillist::client::FilmData;
use pointillist::math::random::Random;
use pointillist::scene::desc::SceneDesc;
use pointillist::scene::load;
use pointillist::server::{RenderJob, Server};
use pointillist::stream::{DrainOrder, Epoch, Event, FinishReason, Lanes, UvWindow};
use pointillist::tracer::integrator::{BidirectionalTracer, ParticleTracer, PhotonTracer, RenderContext};
use pointillist::tracer::{Camera, Integrator, PathTracer, Scene};

use super::client::{COMPARED, SoakClient};
use super::faults::{FaultPlan, Faulty, Made};
use super::{Heart, SoakPlan, SoakReport};

/// A scene and the pictures of it that nothing disturbed.
struct SoakScene {
    file: PathBuf,
    desc: SceneDesc,
    scene: Arc<Scene>,
    /// By method.
    undisturbed: [Option<FilmData>; 4],
}

impl SoakScene {
    fn of(file: PathBuf) -> Self {
        let desc = load(&file, &[]).expect("the scene is there").desc;
        let scene = Arc::new(Scene::prepare(&desc).expect("the scene is valid"));
        Self { file, desc, scene, undisturbed: [const { None }; 4] }
    }

    fn context(&self, seed: u32) -> RenderContext {
        let camera = Camera::of(&self.desc).expect("the camera is valid");
        RenderContext::new(self.scene.clone(), camera, &self.desc.integrator, seed, UvWindow::PICTURE)
    }

    /// The scene with other lights and back again: the same as at first.
    fn edit(&mut self, dice: &mut Random) {
        let mut edited = self.desc.clone();
        let factor = 0.5 + dice.f32();
        for shape in &mut edited.shapes {
            shape.emission = shape.emission.take().map(|e| e.scaled(factor));
        }
        if let Some(bsdf) = edited.bsdfs.first_mut() {
            *bsdf = pointillist::scene::desc::BsdfDesc::grey(dice.f32());
        }
        if dice.below(2) == 0 {
            // This one needs everything anew.
            edited.lights.clear();
            edited.shapes.pop();
        }
        let there = self.scene.edited(&edited).expect("an edited scene");
        self.scene = Arc::new(there.edited(&self.desc).expect("the scene as it was"));
    }

    fn reload(&mut self) {
        let undisturbed = std::mem::take(&mut self.undisturbed);
        *self = Self { undisturbed, ..Self::of(self.file.clone()) };
    }
}

/// How a render ends.
#[derive(Clone, Copy, Debug, PartialEq)]
enum End {
    /// All of this many indices.
    Complete(u64),
    /// By an abort; the lanes are drained.
    Aborted,
    /// By an abort; what lies in the lanes is left to the next render.
    Left,
    /// The next render takes its place.
    Replaced,
    /// A worker panics.
    Panicked(u64),
}

/// Server, lanes and client.
pub struct Renderer {
    server: Server,
    lanes: Lanes,
    client: SoakClient,
    scenes: Vec<SoakScene>,
    epoch: Epoch,
    full_disk: Option<PathBuf>,
    heart: Heart,
    /// Stale samples that the lanes had dropped when they were last empty.
    stale: u64,
    /// Samples of older renders that were in the lanes since.
    left: u64,
    /// Renders since then that were replaced, with what was drained of them: what they left in the lanes is known but for a block per worker.
    replaced: Vec<(Arc<Made>, u64)>,
    threads: u64,
}

/// Indices of a picture that is compared.
const COMPARED_INDICES: u64 = 1 << 14;

impl Renderer {
    /// Opens everything, and renders the undisturbed pictures, each by a server and a device of its own.
    pub fn new(plan: &SoakPlan, heart: Heart) -> Self {
        let mut scenes: Vec<_> = plan.scenes.iter().cloned().map(SoakScene::of).collect();
        for scene in &mut scenes {
            for method in 0..4 {
                let mut report = SoakReport::default();
                let mut alone = Self::start(plan, heart.clone());
                let (end, faults) = (End::Complete(COMPARED_INDICES), FaultPlan::default());
                alone.render(scene, method, end, faults, None, &mut report);
                scene.undisturbed[method] = Some(alone.client.develop(&mut report));
                assert!(report.faults.is_empty(), "an undisturbed render: {:?}", report.faults);
            }
        }
        let mut renderer = Self::start(plan, heart);
        renderer.scenes = scenes;
        renderer
    }

    fn start(plan: &SoakPlan, heart: Heart) -> Self {
        let (server, lanes) = Server::start(plan.threads).expect("threads");
        let client = SoakClient::new(plan.validation);
        let (epoch, full_disk, scenes) = (Epoch::default(), plan.full_disk.clone(), Vec::new());
        let (replaced, threads) = (Vec::new(), plan.threads as u64);
        Self { server, lanes, client, scenes, epoch, full_disk, heart, stale: 0, left: 0, replaced, threads }
    }

    pub fn validation_messages(&self) -> usize {
        self.client.validation_messages()
    }

    /// One render, of whatever the dice say.
    pub fn round(&mut self, dice: &mut Random, report: &mut SoakReport) {
        let which = dice.below(self.scenes.len());
        let mut scene = self.scenes.swap_remove(which);
        match dice.below(12) {
            0 => {
                report.did("scene reloaded");
                scene.reload();
            }
            1..=4 => {
                report.did("scene edited");
                scene.edit(dice);
            }
            _ => {}
        }
        let method = dice.below(4);
        if dice.below(4) == 0 {
            self.picture(&scene, method, dice, report);
        } else {
            let end = match dice.below(8) {
                0..=2 => End::Aborted,
                3 => End::Left,
                4 | 5 => End::Replaced,
                6 => End::Panicked(dice.below(20_000) as u64),
                _ => End::Complete(1 + dice.below(20_000) as u64),
            };
            let faults = FaultPlan {
                seed: dice.bits(),
                bad: [0, 10, 1000][dice.below(3)],
                slow: [0, 0, 200][dice.below(3)],
                panics: if let End::Panicked(index) = end { Some(index) } else { None },
            };
            self.render(&scene, method, end, faults, Some(dice), report);
        }
        self.scenes.push(scene);
    }

    /// The picture of every scene by every method.
    pub fn all_pictures(&mut self, dice: &mut Random, report: &mut SoakReport) {
        let scenes = std::mem::take(&mut self.scenes);
        for scene in &scenes {
            (0..4).for_each(|method| self.picture(scene, method, dice, report));
        }
        self.scenes = scenes;
    }

    /// A disturbed render whose picture must be that of an undisturbed one.
    fn picture(&mut self, scene: &SoakScene, method: usize, dice: &mut Random, report: &mut SoakReport) {
        let faults = FaultPlan { seed: dice.bits(), bad: 50, slow: 2000, panics: None };
        self.render(scene, method, End::Complete(COMPARED_INDICES), faults, Some(dice), report);
        self.client.resize(COMPARED, report);
        self.client.feed(report);
        let data = self.client.develop(report);
        report.pictures += 1;
        if scene.undisturbed[method].as_ref() != Some(&data) {
            let file = scene.file.display();
            report.fault(format!("{file} by method {method} differs from the undisturbed picture"));
        }
    }

    fn render(
        &mut self,
        scene: &SoakScene,
        method: usize,
        end: End,
        faults: FaultPlan,
        dice: Option<&mut Random>,
        report: &mut SoakReport,
    ) {
        let context = scene.context(7);
        match method {
            0 => self.render_by(PathTracer { context }, end, faults, dice, report),
            1 => self.render_by(ParticleTracer { context }, end, faults, dice, report),
            2 => self.render_by(BidirectionalTracer { context }, end, faults, dice, report),
            _ => self.render_by(PhotonTracer::new(context, true), end, faults, dice, report),
        }
    }

    fn render_by<I: Integrator>(
        &mut self,
        inner: I,
        end: End,
        plan: FaultPlan,
        mut dice: Option<&mut Random>,
        report: &mut SoakReport,
    ) {
        let made = Arc::new(Made::default());
        let integrator = Arc::new(Faulty { inner, plan, made: made.clone() });
        let complete = matches!(end, End::Complete(_));
        let range = if let End::Complete(count) = end { 0..count } else { 0..u64::MAX };
        // Blocks are independent of time where the picture is to be.
        let job = RenderJob { deadline: None, ..RenderJob::new(integrator, range) };
        let job = if complete { job } else { RenderJob { deadline: Some(Duration::from_millis(2)), ..job } };
        self.epoch = self.epoch.next();
        if let Err(error) = self.server.render(job, self.epoch) {
            return report.fault(format!("render: {error}"));
        }
        let order = if complete { DrainOrder::Index { first: 0 } } else { DrainOrder::Arrival };
        self.lanes.follow(self.epoch, order);
        self.client.clear();
        report.did(match end {
            End::Complete(_) => "rendered to the end",
            End::Aborted => "aborted and drained",
            End::Left => "aborted and left",
            End::Replaced => "replaced in mid-frame",
            End::Panicked(_) => "worker panicked",
        });
        let time = Duration::from_millis(dice.as_mut().map_or(0, |dice| 20 + dice.below(500) as u64));
        let (drained, finished) = self.follow(end, time, &mut dice, report);
        self.check(end, &made, drained, finished, report);
    }

    /// Drains until the end; returns the samples drained, and how the render finished if it has.
    fn follow(
        &mut self,
        end: End,
        time: Duration,
        dice: &mut Option<&mut Random>,
        report: &mut SoakReport,
    ) -> (u64, Option<FinishReason>) {
        let (start, mut drained, mut finished, mut aborted) = (Instant::now(), 0, None, false);
        loop {
            self.heart.beats();
            let late = start.elapsed() > time && !matches!(end, End::Complete(_) | End::Panicked(_));
            if late && end == End::Replaced {
                return (drained, None);
            }
            if late && !aborted {
                self.server.abort();
                aborted = true;
            }
            while let Some(Event::Finished { epoch, reason, .. }) = self.server.event() {
                if epoch == self.epoch {
                    finished = Some(reason);
                }
            }
            if finished.is_some() && (end == End::Left || self.lanes.is_drained()) {
                return (drained, finished);
            }
            // After an abort that leaves the lanes as they are nothing is drained.
            if !(aborted && end == End::Left) {
                let budget = dice.as_mut().map_or(1 << 16, |dice| 1024 << dice.below(6));
                drained += self.drain(budget, report);
                self.client.feed(report);
            }
            if let Some(dice) = dice.as_mut()
                && dice.below(4) == 0
            {
                if dice.below(5) == 0 {
                    report.did("resized");
                    let side = |dice: &mut Random| 1 + dice.below(150) as u32;
                    let size = [side(dice), side(dice)];
                    self.client.resize(size, report);
                    self.client.feed(report);
                }
                self.client.suffer(dice, self.full_disk.as_deref(), report);
            }
            self.lanes.wait(Duration::from_millis(5));
        }
    }

    fn drain(&mut self, budget: usize, report: &mut SoakReport) -> u64 {
        let client = &mut self.client;
        let drained = self.lanes.drain(budget, |block| {
            if !client.retained.push_for_later(block) {
                client.add(block.samples(), block.header.paths, report);
            }
        });
        drained.samples as u64
    }

    /// The counts of every stage add up.
    fn check(
        &mut self,
        end: End,
        made: &Arc<Made>,
        drained: u64,
        finished: Option<FinishReason>,
        report: &mut SoakReport,
    ) {
        self.client.feed(report);
        let counted = self.client.counted();
        if counted != self.client.fed {
            report.fault(format!("the film counts {counted} of {} samples", self.client.fed));
        }
        if self.client.retained.complete() && counted != drained {
            report.fault(format!("{drained} samples were drained, and the film has {counted}"));
        }
        let Some(reason) = finished else {
            return self.replaced.push((made.clone(), drained));
        };
        report.renders += 1;
        let (samples, bad) = (made.samples.load(Ordering::Relaxed), made.bad.load(Ordering::Relaxed));
        let stats = self.server.stats();
        let total = stats.total();
        let known = total.samples + total.discarded + total.rejections.samples();
        if stats.epoch != self.epoch || known != samples {
            report.fault(format!("{end:?}: {samples} samples made, {known} accounted for: {total:?}"));
        }
        let rejected = total.rejections.samples();
        if rejected != bad {
            report.fault(format!("{end:?}: {bad} bad samples, {rejected} rejected"));
        }
        let expected = match end {
            End::Complete(_) => reason == FinishReason::Complete,
            End::Panicked(at) => matches!(&reason, FinishReason::Panicked { index, .. } if *index == at),
            _ => reason == FinishReason::Aborted,
        };
        if !expected {
            report.fault(format!("{end:?} finished as {reason:?}"));
        }
        if end == End::Left {
            self.left += total.samples - drained;
        } else {
            if total.samples != drained {
                report.fault(format!("{end:?}: {} samples sent, {drained} drained", total.samples));
            }
            self.check_stale(report);
        }
        let sum = &mut report.conservation;
        sum.made += samples;
        sum.rejected += rejected;
        sum.discarded += total.discarded;
        sum.sent += total.samples;
        sum.stale += total.samples - drained;
        sum.accepted += drained;
    }

    /// The lanes are empty: they have dropped what older renders had left in them.
    fn check_stale(&mut self, report: &mut SoakReport) {
        let dropped = self.lanes.stale_samples() - self.stale;
        self.stale += dropped;
        let (mut least, mut most) = (self.left, self.left);
        for (made, drained) in self.replaced.drain(..) {
            let left = made.samples.load(Ordering::Relaxed).saturating_sub(drained);
            // The block that each worker had begun was discarded with the samples rejected in it.
            let begun = made.bad.load(Ordering::Relaxed) + 2048 * self.threads;
            (least, most) = (least + left.saturating_sub(begun), most + left);
        }
        self.left = 0;
        if !(least..=most).contains(&dropped) {
            report.fault(format!("{dropped} samples were dropped from the lanes, not {least} to {most}"));
        }
    }
}
