//! Choosing and opening devices.

use std::sync::{Arc, Mutex};

use crate::common::{assert_silent, gpu};
use pointillist::client::film::VulkanFilm;
use pointillist::client::layout::DownsamplePush;
use pointillist::client::{Film, Reconstruction, SplatFilter};
use pointillist::gpu::{
    Access, Attachment, Blend, DeviceChoice, Gpu, GpuError, GraphicsDesc, Image, Pipeline, TexelFormat,
    Texture, Topology, VertexLayout, devices,
};

#[test]
fn devices_are_listed_and_chosen() {
    let list = devices().expect("a driver: on Debian, apt-get install mesa-vulkan-drivers");
    let best = gpu().info();
    assert!(list.contains(best));
    assert!(best.is_suitable() && best.suitability() == "can be used");

    assert_eq!(DeviceChoice::parse(""), DeviceChoice::Best);
    assert_eq!(DeviceChoice::parse("3"), DeviceChoice::Index(3));
    let name = best.name.to_uppercase();
    let same = Gpu::new(&DeviceChoice::parse(&name)).expect("by name, in any case of letters");
    assert_eq!(same.info(), best);
    let same = Gpu::new(&DeviceChoice::Index(best.index)).expect("by index");
    assert_eq!(same.info(), best);
    assert_silent(gpu());
}

#[test]
fn an_unknown_device_is_a_sentence() {
    for choice in [DeviceChoice::Index(99), DeviceChoice::Name("no such card".into())] {
        let error = Gpu::new(&choice).expect_err("there is no such device");
        assert!(matches!(error, GpuError::NoMatch { .. }));
        assert!(error.to_string().contains(&gpu().info().name), "{error}");
    }
}

/// The other tests trust that silence means correct: a planted mistake must be reported.
///
/// The layer of Debian 12 (1.3.239) follows copies and what draws read, but not the attachments of dynamic rendering.
#[test]
fn validation_catches_a_planted_hazard() {
    let own = crate::common::open(false);
    let make = |(name, side)| Image::new(&own, name, TexelFormat::R32F, [side; 2]).expect(name);
    let [mut source, mut copy, mut hi, mut lo] =
        [("source", 8), ("copy", 8), ("color", 4), ("variance", 4)].map(make);
    let pipeline = Pipeline::new(
        &own,
        &GraphicsDesc {
            name: "planted",
            vert: ("fullscreen.vert", &[]),
            frag: ("downsample.frag", &[2, 2, 1]),
            push_bytes: size_of::<DownsamplePush>(),
            textures: 2,
            attachments: &[(TexelFormat::R32F, Blend::Replace); 2],
            layers: 1,
            topology: Topology::Fullscreen,
            vertex: VertexLayout::default(),
        },
    );
    let pipeline = pipeline.expect("a pipeline");
    for planted in [false, true] {
        let mut frame = own.begin().expect("a frame");
        let cmd = &mut frame.cmd();
        cmd.access(&mut source, Access::ColorWrite);
        cmd.rendering(&[Attachment::cleared(&source)], |_| ());
        cmd.copy_levels(&mut source, &mut copy, &[[0, 0]]);
        if !planted {
            cmd.access(&mut copy, Access::Sampled);
        }
        cmd.access(&mut hi, Access::ColorWrite);
        cmd.access(&mut lo, Access::ColorWrite);
        let attachments = [&hi, &lo].map(Attachment::whole);
        let push = DownsamplePush { source: [8; 2] };
        cmd.draw_fullscreen(&pipeline, bytemuck::bytes_of(&push), &[Texture::texels(&copy); 2], &attachments);
        if planted {
            drop(frame); // never submitted
        } else {
            own.wait(frame.submit().expect("submit")).expect("wait");
            assert_silent(&own);
        }
    }
    let messages = own.validation_messages();
    assert!(messages.iter().any(|m| m.contains("SYNC-HAZARD-READ-AFTER-WRITE")), "{messages:?}");
}

/// Pipelines of one run are loaded by the next one on the same device; anything else is refused with a sentence, and the device
/// compiles as before.
#[test]
fn compiled_pipelines_are_kept() {
    let spec = crate::common::spec(50, 40, SplatFilter::Gaussian);
    let picture = |gpu: &Arc<Gpu>| {
        let mut film = VulkanFilm::new(gpu.clone(), spec).expect("a film");
        film.add(&crate::common::scene(&spec, 3_000, 2, 2)).expect("add");
        film.display(&crate::common::settings(Reconstruction::Gaussian, 0.5)).expect("display")
    };
    let first = crate::common::open(false);
    assert_eq!(first.take_pipelines().expect("data"), None, "nothing was compiled");
    let wanted = picture(&first);
    let data = first.take_pipelines().expect("data").expect("pipelines were compiled");
    assert_eq!(first.take_pipelines().expect("data"), None, "nothing new was compiled");
    let second = crate::common::open(false);
    assert_eq!(second.pipeline_origin(), first.pipeline_origin());
    second.load_pipelines(&data).expect("the data of this device");
    assert!(picture(&second) == wanted);
    for foreign in [Vec::new(), data[..20].to_vec(), vec![7; 4_000], [&[data[0] ^ 1], &data[1..]].concat()] {
        let error = second.load_pipelines(&foreign).expect_err("no data of this device");
        assert!(error.to_string().contains("cannot be loaded"), "{error}");
    }
    assert!(picture(&second) == wanted);
    assert_silent(&first);
    assert_silent(&second);
}

/// Scopes are summed by name, only while timing is on.
#[test]
fn scopes_are_timed() {
    let own = crate::common::open(false);
    let frame = |n: usize| {
        let mut frame = own.begin().expect("a frame");
        for _ in 0..n {
            let mut cmd = frame.cmd();
            let mut outer = cmd.scope("outer");
            drop(outer.scope("inner"));
        }
        own.wait(frame.submit().expect("submit")).expect("wait");
    };
    frame(3);
    assert!(own.take_timings().is_empty());
    own.set_timing(true);
    frame(2);
    frame(1);
    let times = own.take_timings();
    let counts: Vec<_> = times.iter().map(|t| (t.name, t.count)).collect();
    assert_eq!(counts, [("outer", 3), ("inner", 3)]);
    assert!(times.iter().all(|t| t.milliseconds >= 0.0));
    frame(1000); // more scopes than there are timestamps: the rest is not measured
    assert!(own.take_timings().iter().all(|t| t.count <= 1000));
    assert_silent(&own);
}

/// Where the log goes while a test listens.
#[derive(Clone, Default)]
struct Log(Arc<Mutex<Vec<u8>>>);

impl std::io::Write for Log {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.lock().expect("not poisoned").extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

/// Everything that was made is destroyed before the device: the layer would report what is left, in the log.
#[test]
fn nothing_is_left_behind() {
    let log = Log::default();
    let writer = log.clone();
    let subscriber = tracing_subscriber::fmt().with_ansi(false).with_writer(move || writer.clone()).finish();
    tracing::subscriber::with_default(subscriber, || {
        let own = crate::common::open(false);
        let spec = crate::common::spec(50, 40, SplatFilter::Gaussian);
        let mut film = VulkanFilm::new(own.clone(), spec).expect("a film");
        film.add(&crate::common::scene(&spec, 80_000, 2, 2)).expect("add");
        film.display(&crate::common::settings(Reconstruction::Gaussian, 0.5)).expect("display");
        film.develop().expect("develop");
        assert_silent(&own);
        drop(own);
        drop(film); // the last owner of the device
        tracing::warn!("the log listens");
    });
    let text = String::from_utf8(log.0.lock().expect("not poisoned").clone()).expect("text");
    assert!(text.contains("the log listens"), "{text}");
    assert_eq!(text.lines().count(), 1, "{text}");
}
