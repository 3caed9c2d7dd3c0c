//! Build script: embeds the shaders.
//!
//! Without features the SPIR-V committed in `glsl/spv/` is embedded, after a check that it belongs to the GLSL beside
//! it (`glsl/spv/HASHES`), so that building needs no shader compiler. With the feature `shaderc` everything is compiled
//! anew into `OUT_DIR`. To refresh what is committed (on Debian, with libshaderc-dev glslang-dev spirv-tools):
//!
//! ```sh
//! POINTILLIST_UPDATE_SPIRV=1 cargo --config tools/shaderc-debian.toml check --features shaderc
//! ```

use std::error::Error;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::{env, fs};

type Outcome<T> = Result<T, Box<dyn Error>>;

fn main() -> Outcome<()> {
    let root = PathBuf::from(env::var("CARGO_MANIFEST_DIR")?);
    let (glsl, out) = (root.join("glsl"), PathBuf::from(env::var("OUT_DIR")?));
    println!("cargo::rerun-if-changed=glsl");
    println!("cargo::rerun-if-env-changed=POINTILLIST_UPDATE_SPIRV");
    let shaders = shaders(&glsl)?;
    let folder = if cfg!(feature = "shaderc") {
        compile_all(&glsl, &shaders, &out)?;
        if env::var_os("POINTILLIST_UPDATE_SPIRV").is_some() {
            update(&glsl, &shaders, &out)?;
        }
        "env!(\"OUT_DIR\"), \"/"
    } else {
        check(&glsl, &shaders)?;
        "env!(\"CARGO_MANIFEST_DIR\"), \"/glsl/spv/"
    };
    fs::write(out.join("shaders.rs"), table(&shaders, folder))?;
    Ok(())
}

/// What a shader names that is compiled a second time, for images of several layers, as `NAME.layers`.
const LAYERS: &str = "include/layers.glsl";

/// Names of all shaders (`splat.vert`, …) with the hash of their sources, sorted.
fn shaders(glsl: &Path) -> Outcome<Vec<(String, u64)>> {
    let mut shared = String::new();
    for name in files(&glsl.join("include"), &["glsl"])? {
        shared += &fs::read_to_string(glsl.join("include").join(name))?;
    }
    let mut list = Vec::new();
    for name in files(glsl, &["vert", "frag", "comp"])? {
        let text = fs::read_to_string(glsl.join(&name))?;
        let hash = fnv1a(text.as_bytes(), fnv1a(shared.as_bytes(), FNV_OFFSET));
        let layered = text.contains(LAYERS).then(|| (format!("{name}.layers"), hash));
        list.extend([(name, hash)].into_iter().chain(layered));
    }
    Ok(list)
}

/// Names of the files in `folder` with one of these extensions, sorted.
fn files(folder: &Path, extensions: &[&str]) -> Outcome<Vec<String>> {
    let mut names = Vec::new();
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        let known = path.extension().is_some_and(|e| extensions.iter().any(|x| e == *x));
        if let (true, Some(name)) = (known, path.file_name().and_then(|n| n.to_str())) {
            names.push(name.to_owned());
        }
    }
    names.sort();
    Ok(names)
}

const FNV_OFFSET: u64 = 0xcbf2_9ce4_8422_2325;

/// The 64-bit FNV-1a hash of `bytes`, continued from `state` (Fowler, Noll, Vo). Line ends do not count.
fn fnv1a(bytes: &[u8], state: u64) -> u64 {
    let bytes = bytes.iter().filter(|b| **b != b'\r');
    bytes.fold(state, |h, b| (h ^ u64::from(*b)).wrapping_mul(0x0100_0000_01b3))
}

/// The contents of `HASHES`: one line per shader.
fn hashes(shaders: &[(String, u64)]) -> String {
    shaders.iter().fold(String::new(), |mut text, (name, hash)| {
        let _ = writeln!(text, "{hash:016x}  {name}");
        text
    })
}

/// Refuses to build with SPIR-V that was compiled from other sources.
fn check(glsl: &Path, shaders: &[(String, u64)]) -> Outcome<()> {
    let committed = fs::read_to_string(glsl.join("spv/HASHES")).unwrap_or_default().replace('\r', "");
    let wanted = hashes(shaders);
    if committed == wanted {
        return Ok(());
    }
    let stale: Vec<&str> = wanted.lines().filter(|l| !committed.lines().any(|c| c == *l)).collect();
    Err(format!(
        "glsl/spv/ does not belong to the GLSL sources (stale or missing: {}). Refresh it with\n  \
         POINTILLIST_UPDATE_SPIRV=1 cargo --config tools/shaderc-debian.toml check --features shaderc",
        stale.iter().filter_map(|l| l.split("  ").nth(1)).collect::<Vec<_>>().join(", ")
    )
    .into())
}

/// A Rust slice of `(name, bytes)`, included by `src/gpu/resources/shader.rs`. `folder`: beginning of the arguments of `concat!` for
/// a path; no absolute one, so that a checkout may be moved.
fn table(shaders: &[(String, u64)], folder: &str) -> String {
    let mut text = String::from("&[\n");
    for (name, _) in shaders {
        let _ = writeln!(text, "    ({name:?}, include_bytes!(concat!({folder}{name}.spv\")).as_slice()),");
    }
    text + "]\n"
}

/// Copies what was compiled to `glsl/spv/`, where it differs.
fn update(glsl: &Path, shaders: &[(String, u64)], out: &Path) -> Outcome<()> {
    let spv = glsl.join("spv");
    fs::create_dir_all(&spv)?;
    for (name, _) in shaders {
        write_if_new(&spv.join(format!("{name}.spv")), &fs::read(out.join(format!("{name}.spv")))?)?;
    }
    for name in files(&spv, &["spv"])? {
        if !shaders.iter().any(|(shader, _)| name == format!("{shader}.spv")) {
            fs::remove_file(spv.join(name))?;
        }
    }
    write_if_new(&spv.join("HASHES"), hashes(shaders).as_bytes())
}

/// Writes a file unless it already holds these bytes, so that it does not look changed.
fn write_if_new(path: &Path, bytes: &[u8]) -> Outcome<()> {
    if fs::read(path).ok().as_deref() != Some(bytes) {
        fs::write(path, bytes)?;
    }
    Ok(())
}

#[cfg(not(feature = "shaderc"))]
fn compile_all(_: &Path, _: &[(String, u64)], _: &Path) -> Outcome<()> {
    Err("the feature shaderc is off".into())
}

/// Compiles every shader into `out`: Vulkan 1.3, not optimised (drivers do that, and names stay readable).
#[cfg(feature = "shaderc")]
fn compile_all(glsl: &Path, shaders: &[(String, u64)], out: &Path) -> Outcome<()> {
    let compiler = shaderc::Compiler::new()?;
    let mut options = shaderc::CompileOptions::new()?;
    options.set_target_env(shaderc::TargetEnv::Vulkan, shaderc::EnvVersion::Vulkan1_3 as u32);
    options.set_warnings_as_errors();
    options.set_include_callback(|name, _, _, _| {
        let content = fs::read_to_string(glsl.join(name)).map_err(|e| format!("{name}: {e}"))?;
        Ok(shaderc::ResolvedInclude { resolved_name: name.to_owned(), content })
    });
    for (name, _) in shaders {
        let mut options = options.clone();
        let source = name.strip_suffix(".layers").unwrap_or(name);
        if source != name {
            options.add_macro_definition("LAYERS", None);
        }
        let kind = match source.rsplit('.').next() {
            Some("vert") => shaderc::ShaderKind::Vertex,
            Some("comp") => shaderc::ShaderKind::Compute,
            _ => shaderc::ShaderKind::Fragment,
        };
        let text = fs::read_to_string(glsl.join(source))?.replace('\r', "");
        let code = compiler.compile_into_spirv(&text, kind, source, "main", Some(&options))?;
        fs::write(out.join(format!("{name}.spv")), code.as_binary_u8())?;
    }
    Ok(())
}
