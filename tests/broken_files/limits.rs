//! Inputs that are too large, too deep or include themselves are refused in time, with a place.

use crate::guard::{folder, guarded, outcome, write};
use crate::held_memory::MOST;
use crate::messages::{assert_has_place, render};
use pointillist::scene::{SceneError, load_str};

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
fn integrators_within_each_other_are_bounded() {
    let wrapper = |i: i32| format!("<integrator type='aov' id='a{i}'><ref id='a{}'/></integrator>", i + 1);
    let chain: String = (0..5000).map(wrapper).collect();
    refused(
        "a chain of integrators",
        format!("<scene version='3.0.0'>{chain}<integrator type='path' id='a5000'/></scene>"),
    );
    refused(
        "a circle of integrators",
        format!("<scene version='3.0.0'>{}<alias id='a0' as='a1'/></scene>", wrapper(0)),
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
    // Well above the bound: what other tests free meanwhile is counted too.
    let caught = std::panic::catch_unwind(|| {
        guarded("too much", || drop(std::hint::black_box(Vec::<u8>::with_capacity(2 * MOST))))
    });
    assert!(caught.is_err(), "the allocator must notice");
    let caught = std::panic::catch_unwind(|| guarded("a panic", || panic!("on purpose")));
    assert!(caught.is_err());
}

/// Counting the columns of each shape from the start of the line would take minutes here.
#[test]
fn one_line_with_thousands_of_shapes_is_read_in_time() {
    let count = 20_000;
    let shapes = "<shape type='disk'><float name='oops' value='1'/></shape>".repeat(count);
    let text = format!(
        "<scene version='3.0.0'><sensor type='perspective'/><emitter type='constant'/>{shapes}</scene>"
    );
    let (shapes, warnings) = guarded("one line", move || {
        let loaded = load_str("line.xml", &text, &[]).unwrap_or_else(|e| panic!("{e:?}"));
        (loaded.desc.shapes.len(), loaded.warnings)
    });
    assert_eq!(shapes, count);
    assert!(warnings.len() < 300 && warnings.last().is_some_and(|w| w.to_string().contains("more warnings")));
}

/// A list of wavelengths is processed once, not once for each reference to it.
#[test]
fn a_spectrum_with_many_references_is_read_in_time() {
    let list: String = (0..20_000).map(|i| format!("{}:1 ", 300.0 + f64::from(i) * 0.02)).collect();
    let uses = "<bsdf type='diffuse'><ref id='s' name='reflectance'/></bsdf>".repeat(10_000);
    let text = format!(
        "<scene version='3.0.0'><sensor type='perspective'/><emitter type='constant'/>\
         <spectrum id='s' name='s' value='{list}'/>{uses}</scene>"
    );
    let bsdfs = guarded("many references", move || {
        load_str("uses.xml", &text, &[]).unwrap_or_else(|e| panic!("{e:?}")).desc.bsdfs.len()
    });
    assert_eq!(bsdfs, 10_000);
}
