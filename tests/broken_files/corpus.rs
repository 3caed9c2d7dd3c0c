//! The short form of `tools/fuzz`: every file of the corpora, and mutations of them that are the same in every run, through every reader.

use std::path::{Path, PathBuf};

use pointillist::math::random::Random;

use crate::corrupt::{NUMBERS, corrupt};
use crate::guard::{folder, guarded};
use crate::images::mend_checksums;
use crate::targets::{ALL, Target, prepare};

/// Mutations of each corpus.
const MUTATIONS: usize = 500;

/// The corpus of a target: what its readers are to take, and what once broke one of them.
fn corpus(target: &Target) -> Vec<(String, Vec<u8>)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tools/fuzz_targets/corpus").join(target.name);
    let files = std::fs::read_dir(&folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    let mut paths: Vec<PathBuf> = files.map(|file| file.unwrap().path()).collect();
    paths.sort();
    assert!(!paths.is_empty(), "{} is empty", folder.display());
    let name = |path: &Path| format!("{}/{}", target.name, path.file_name().unwrap().display());
    paths.into_iter().map(|path| (name(&path), std::fs::read(&path).unwrap())).collect()
}

/// One of the changes of [`corrupt`], or a piece of another file of the corpus.
fn mutate(bytes: &mut Vec<u8>, other: &[u8], random: &mut Random) {
    if random.below(3) > 0 {
        return corrupt(bytes, random, NUMBERS);
    }
    let from = random.below(other.len());
    let piece = &other[from..(from + 1 + random.below(64)).min(other.len())];
    let at = random.below(bytes.len());
    // In place of what is there, or before it.
    let end = if random.below(2) == 0 { at } else { (at + piece.len()).min(bytes.len()) };
    bytes.splice(at..end, piece.iter().copied());
}

/// Reads one input under guard; true if it was not refused.
fn read(target: &'static Target, folder: &Path, what: &str, bytes: Vec<u8>) -> bool {
    let folder = folder.to_owned();
    guarded(what, move || (target.read)(&folder, &bytes))
}

#[test]
fn every_corpus_and_mutations_of_it() {
    let mut random = Random(18);
    for target in ALL {
        let (folder, corpus) = (folder(&format!("corpus_{}", target.name)), corpus(target));
        prepare(&folder);
        let (mut taken, mut refused) = (0, 0);
        let mut count = |was_read| if was_read { taken += 1 } else { refused += 1 };
        for (name, bytes) in &corpus {
            let was_read = read(target, &folder, name, bytes.clone());
            // What the fuzzer has found is named by a hash, and may be refused.
            assert!(was_read || name.len() - target.name.len() > 40, "{name} is refused");
            count(was_read);
        }
        for i in 0..MUTATIONS {
            let (name, mut bytes) = corpus[i % corpus.len()].clone();
            let (_, other) = &corpus[random.below(corpus.len())];
            (0..=random.below(3)).for_each(|_| mutate(&mut bytes, other, &mut random));
            mend_checksums(&mut bytes);
            count(read(target, &folder, &format!("mutation {i} of {name}"), bytes));
        }
        println!("{}: {taken} read, {refused} refused", target.name);
        assert!(
            taken > 0 && refused > 0,
            "{}: {taken} read, {refused} refused: of what use is it?",
            target.name
        );
    }
}
