//! Choosing and opening devices.

mod gpu_support;

use gpu_support::{assert_silent, gpu};
use pointillist::gpu::{DeviceChoice, Gpu, GpuError, devices};

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
