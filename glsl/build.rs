//! Build script: embeds the committed SPIR-V (written by the gpu part).

fn main() {}
