//! Breaks a pass of a device: another value of a constant in a shader that a program holds.

use memchr::memmem::Finder;

/// First word of a module.
const MAGIC: u32 = 0x0723_0203;

/// Words before the first instruction.
const HEADER: usize = 5;

/// The height of the narrowest of the three tents that make up the Gaussian of `splat_color.frag`: see `glsl/include/filter.glsl`.
pub const NARROW_TENT: f32 = 0.158_791_915;

/// Replaces the value `from` of a constant of `module` by `to` in every copy of the module that `program` holds, and returns the number of copies.
///
/// # Errors
/// A sentence if `module` is no SPIR-V, if not exactly one of its constants has this value, or if `program` does not hold it.
pub fn replace_constant(program: &mut [u8], module: &[u8], [from, to]: [f32; 2]) -> Result<usize, String> {
    let offset = constant(module, from)?;
    let copies: Vec<usize> = Finder::new(module).find_iter(program).collect();
    if copies.is_empty() {
        return Err("the program does not hold this shader: build it from this source".into());
    }
    for copy in &copies {
        program[copy + offset..copy + offset + 4].copy_from_slice(&to.to_bits().to_le_bytes());
    }
    Ok(copies.len())
}

/// Where the value of the only single-precision constant of this value stands in a module, in bytes.
fn constant(module: &[u8], value: f32) -> Result<usize, String> {
    /// `OpTypeFloat`.
    const TYPE_FLOAT: u32 = 22;
    /// `OpConstant`.
    const CONSTANT: u32 = 43;
    let words: Vec<u32> =
        module.chunks_exact(4).map(|word| u32::from_le_bytes([word[0], word[1], word[2], word[3]])).collect();
    if words.first() != Some(&MAGIC) {
        return Err("this is no module of SPIR-V".into());
    }
    let (mut at, mut single, mut found) = (HEADER, None, Vec::new());
    while let Some(&first) = words.get(at) {
        let length = (first >> 16) as usize;
        let Some(instruction) = words.get(at..at + length).filter(|_| length > 0) else {
            return Err("this module of SPIR-V is cut short".into());
        };
        match (first & 0xffff, instruction) {
            (TYPE_FLOAT, [_, id, 32, ..]) => single = Some(*id),
            (CONSTANT, [_, kind, _, bits]) if Some(*kind) == single && *bits == value.to_bits() => {
                found.push(4 * (at + 3));
            }
            _ => {}
        }
        at += length;
    }
    match found[..] {
        [only] => Ok(only),
        _ => Err(format!("{} constants of the module are {value}, and not one", found.len())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A module with the type of id 6 and constants of it.
    fn module(constants: &[f32]) -> Vec<u8> {
        let mut words = vec![MAGIC, 0x0001_0600, 0, 99, 0, 3 << 16 | 22, 6, 32];
        for (id, value) in (7..).zip(constants) {
            words.extend([4 << 16 | 43, 6, id, value.to_bits()]);
        }
        // A constant of another type with the same bits, and the same bits in a name.
        words.extend([4 << 16 | 43, 5, 98, constants[0].to_bits(), 3 << 16 | 5, 98, constants[0].to_bits()]);
        words.into_iter().flat_map(u32::to_le_bytes).collect()
    }

    #[test]
    fn one_constant_is_replaced_in_every_copy_and_nothing_else() {
        let (old, new) = (module(&[0.25, 0.5]), module(&[0.25, 0.75]));
        let mut program = [b"abc", &old[..], b"d", &old[..], &0.5f32.to_le_bytes()].concat();
        assert_eq!(replace_constant(&mut program, &old, [0.5, 0.75]), Ok(2));
        assert_eq!(program, [b"abc", &new[..], b"d", &new[..], &0.5f32.to_le_bytes()].concat());
    }

    #[test]
    fn what_is_not_there_once_is_refused() {
        let twice = module(&[0.5, 0.5]);
        let mut program = twice.clone();
        assert!(
            replace_constant(&mut program, &twice, [0.5, 1.0]).is_err_and(|e| e.starts_with("2 constants"))
        );
        assert!(
            replace_constant(&mut program, &twice, [0.25, 1.0]).is_err_and(|e| e.starts_with("0 constants"))
        );
        let other = module(&[0.125]);
        assert!(replace_constant(&mut program, &other, [0.125, 1.0]).is_err_and(|e| e.contains("not hold")));
        assert!(
            replace_constant(&mut program, &other[..40], [0.125, 1.0])
                .is_err_and(|e| e.contains("cut short"))
        );
        assert!(replace_constant(&mut program, b"text", [0.125, 1.0]).is_err());
        assert_eq!(program, twice);
    }

    /// The constant that the study breaks.
    #[test]
    fn the_splat_shader_has_the_height_of_its_narrow_tent_once() {
        let splat = include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/glsl/spv/splat_color.frag.spv"));
        let mut program = splat.to_vec();
        assert_eq!(replace_constant(&mut program, splat, [NARROW_TENT, 0.0]), Ok(1));
        assert_eq!(program.iter().zip(splat).filter(|(a, b)| a != b).count(), 4);
    }
}
