//! Every file of the fuzz corpus through the entry point of its target, as the fuzzer runs it.

use std::fs;
use std::path::Path;

#[path = "fuzz/entries.rs"]
mod entries;

/// Runs a target on each file of its corpus; how many files there were.
fn replay(target: &str, run: fn(&[u8])) -> usize {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fuzz/corpus");
    let mut paths: Vec<_> = fs::read_dir(folder.join(target))
        .expect("the target has a corpus")
        .map(|entry| entry.expect("an entry").path())
        .collect();
    paths.sort();
    for path in &paths {
        let bytes = fs::read(path).expect("a file");
        let outcome = std::panic::catch_unwind(|| run(&bytes));
        assert!(outcome.is_ok(), "{} is a finding", path.display());
    }
    paths.len()
}

macro_rules! targets {
    ($($test:ident: $target:ident, at least $count:literal;)*) => {
        $(
            #[test]
            fn $test() {
                let count = replay(stringify!($target), entries::$target);
                assert!(count >= $count, "only {count} files");
            }
        )*

        #[test]
        fn every_target_has_a_program_and_is_replayed() {
            let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fuzz/fuzz_targets");
            let mut found: Vec<_> = fs::read_dir(root)
                .expect("the targets")
                .map(|entry| entry.expect("an entry").file_name().to_string_lossy().replace(".rs", ""))
                .collect();
            found.sort();
            let mut replayed = vec![$(stringify!($target)),*];
            replayed.sort_unstable();
            assert_eq!(found, replayed);
        }
    };
}

targets! {
    model_files_of_the_corpus_never_panic_and_read_back: model_file, at least 10;
    expressions_of_the_corpus_print_and_parse_back: expression, at least 50;
    recordings_of_the_corpus_never_panic_and_read_back: recording, at least 5;
    gzip_recordings_of_the_corpus_never_panic: recording_gz, at least 4;
    npz_files_of_the_corpus_never_panic: import_npz, at least 2;
    safetensors_files_of_the_corpus_never_panic: import_safetensors, at least 1;
    latex_of_the_corpus_never_panics_and_equals_itself: import_latex, at least 7;
    equations_of_the_corpus_never_panic: import_equations, at least 2;
    column_maps_of_the_corpus_never_panic_and_what_reads_is_sound: column_map, at least 3;
    mcap_files_of_the_corpus_never_panic_and_what_reads_is_sound: mcap, at least 2;
    robot_files_of_the_corpus_never_panic_and_read_back: robot_file, at least 3;
}
