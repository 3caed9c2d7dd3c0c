//! The embedded shaders: complete, the committed ones, and laid out as the host thinks.
//!
//! With the feature `shaderc` the build has compiled every shader anew, and what is committed must be the same bytes
//! (on Debian 12's libshaderc; how to refresh it stands in `glsl/build.rs`).

use std::collections::BTreeMap;
use std::fs;
use std::path::PathBuf;

use crate::support::place::root;
use pointillist::client::{layout, post_process};
use pointillist::gpu::{shader_code, shader_names};

fn glsl() -> PathBuf {
    root().join("glsl")
}

#[test]
fn every_source_is_embedded() {
    let mut sources: Vec<String> = fs::read_dir(glsl())
        .expect("glsl/")
        .map(|entry| entry.expect("an entry").file_name().into_string().expect("a name"))
        .filter(|name| name.ends_with(".vert") || name.ends_with(".frag") || name.ends_with(".comp"))
        .collect();
    sources.sort();
    let (layered, single): (Vec<_>, Vec<_>) = shader_names().partition(|name| name.ends_with(".layers"));
    assert_eq!(single, sources);
    assert!(!sources.is_empty() && !layered.is_empty());
    for name in layered {
        let source = name.strip_suffix(".layers").expect("as filtered");
        let text = fs::read_to_string(glsl().join(source)).expect("its source");
        assert!(text.contains("include/layers.glsl"), "{source} has no layers");
    }
}

#[test]
fn embedded_code_is_what_is_committed() {
    for name in shader_names() {
        let committed = fs::read(glsl().join("spv").join(format!("{name}.spv"))).expect("committed SPIR-V");
        assert!(
            shader_code(name).expect("listed") == committed,
            "{name} compiles to something else than glsl/spv/{name}.spv: refresh it as glsl/build.rs says"
        );
    }
}

/// A block as SPIR-V tells: members with name and offset, and the bytes that they take.
#[derive(Default)]
struct Block {
    name: String,
    members: BTreeMap<u32, (String, usize)>,
    bytes: usize,
}

/// The push constant block of a module, if it has one.
fn push_block(code: &[u8]) -> Option<Block> {
    let words: Vec<u32> =
        code.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
    assert_eq!(words[0], 0x0723_0203, "not SPIR-V");
    let text = |words: &[u32]| {
        let bytes: Vec<u8> = words.iter().flat_map(|w| w.to_le_bytes()).take_while(|b| *b != 0).collect();
        String::from_utf8(bytes).expect("a name in UTF-8")
    };
    let mut blocks: BTreeMap<u32, Block> = BTreeMap::new();
    let (mut structs, mut pointers, mut sizes) = (BTreeMap::new(), BTreeMap::new(), BTreeMap::new());
    let mut push = None;
    let mut at = 5;
    while at < words.len() {
        let (length, opcode) = ((words[at] >> 16) as usize, words[at] & 0xffff);
        let w = &words[at + 1..at + length];
        match opcode {
            5 => blocks.entry(w[0]).or_default().name = text(&w[1..]),
            6 => blocks.entry(w[0]).or_default().members.entry(w[1]).or_default().0 = text(&w[2..]),
            72 if w[2] == 35 => {
                blocks.entry(w[0]).or_default().members.entry(w[1]).or_default().1 = w[3] as usize;
            }
            21 | 22 => drop(sizes.insert(w[0], w[1] as usize / 8)),
            20 => drop(sizes.insert(w[0], 4)),
            23 => drop(sizes.insert(w[0], sizes[&w[1]] * w[2] as usize)),
            30 => drop(structs.insert(w[0], w[1..].to_vec())),
            32 if w[1] == 9 => drop(pointers.insert(w[0], w[2])),
            59 if w[2] == 9 => push = pointers.get(&w[0]).copied(),
            _ => {}
        }
        at += length;
    }
    let id = push?;
    let mut block = blocks.remove(&id)?;
    let last = *structs.get(&id)?.last()?;
    block.bytes = block.members.values().last()?.1 + sizes[&last];
    Some(block)
}

/// Every block of every shader, member by member, against `client/layout.rs` and the post-processes.
#[test]
fn blocks_are_laid_out_as_on_the_host() {
    let mut seen = Vec::new();
    let known = || post_process::BLOCKS.iter().copied().chain([layout::BLOCKS]).flatten();
    for shader in shader_names() {
        let Some(block) = push_block(shader_code(shader).expect("listed")) else {
            continue;
        };
        let of_host = known().find(|known| known.name == block.name);
        let layout::PushBlock { name, bytes, members } =
            of_host.unwrap_or_else(|| panic!("{shader}: unknown block {}", block.name));
        let got: Vec<(&str, usize)> = block.members.values().map(|(name, at)| (name.as_str(), *at)).collect();
        assert_eq!(got, *members, "{shader}: members of {name}");
        assert_eq!(block.bytes, *bytes, "{shader}: size of {name}");
        seen.push(*name);
    }
    for layout::PushBlock { name, .. } in known() {
        assert!(seen.contains(name), "no shader has the block {name}");
    }
}
