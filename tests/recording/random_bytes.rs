//! The reader never panics, and accepted recordings are finite.

use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use romc::recording::PhaseRule;
use romc::recording::check::{check, without};
use romc::recording::preprocess::prepare;
use romc::recording::{Recording, read_from_bytes};
use romc::robot::InputRule;

use crate::sheet::{Sheet, gzip};

/// Reads and, if successful, runs everything that follows.
fn exercise(bytes: &[u8]) {
    let Ok(recording) = read_from_bytes("random.csv", bytes) else {
        return;
    };
    require_finite(&recording);
    let go1 = romc::robot_file::by_name("go1").expect("go1 is registered");
    let findings = check(&recording, go1);
    for finding in &findings {
        assert!(!finding.to_string().is_empty());
    }
    if let Ok((rest, dropped)) = without(&recording, &findings) {
        assert_eq!(rest.sample_count() + dropped, recording.sample_count());
    }
    for segment in &recording.segments {
        if let Ok(input) = segment.input(&InputRule::published(go1)) {
            assert_eq!(input.shape(), (18, segment.len()));
        }
    }
    if let Ok(phases) = prepare(&recording, &PhaseRule::two_phase().with_min_samples(5)) {
        assert!(phases.iter().all(|(_, samples)| samples.len() % 100 == 0));
    }
}

fn require_finite(recording: &Recording) {
    for segment in &recording.segments {
        assert!(segment.len() >= 2);
        assert!(segment.time_s.windows(2).all(|pair| pair[0] < pair[1]));
        for matrix in [&segment.x, &segment.dx, &segment.ddx, &segment.torque_nm] {
            assert!(matrix.iter().all(|value| value.is_finite()));
        }
    }
}

/// Place and kind of the damage to the text.
#[derive(Debug, Clone)]
enum Damage {
    Replace(usize, u8),
    Insert(usize, Vec<u8>),
    Remove(usize, usize),
    Copy(usize, usize, usize),
}

fn damage() -> impl Strategy<Value = Damage> {
    let byte = prop_oneof![
        any::<u8>(),
        prop::sample::select(b"0123456789;,.\n\r\"-+eE \tnaif".to_vec())
    ];
    prop_oneof![
        (any::<usize>(), byte.clone()).prop_map(|(at, byte)| Damage::Replace(at, byte)),
        (any::<usize>(), prop::collection::vec(byte, 1..8))
            .prop_map(|(at, bytes)| Damage::Insert(at, bytes)),
        (any::<usize>(), 1..400_usize).prop_map(|(at, count)| Damage::Remove(at, count)),
        (any::<usize>(), any::<usize>(), 1..1500_usize)
            .prop_map(|(from, to, count)| Damage::Copy(from, to, count)),
    ]
}

fn damaged(mut bytes: Vec<u8>, all: &[Damage]) -> Vec<u8> {
    for damage in all {
        let place = |at: usize| at % bytes.len().max(1);
        match damage {
            Damage::Replace(at, byte) => {
                let at = place(*at);
                if let Some(cell) = bytes.get_mut(at) {
                    *cell = *byte;
                }
            }
            Damage::Insert(at, inserted) => {
                let at = place(*at);
                bytes.splice(at..at, inserted.iter().copied());
            }
            Damage::Remove(at, count) => {
                let at = place(*at);
                let end = (at + count).min(bytes.len());
                bytes.drain(at..end);
            }
            Damage::Copy(from, to, count) => {
                let (from, to) = (place(*from), place(*to));
                let end = (from + count).min(bytes.len());
                let part = bytes[from..end].to_vec();
                bytes.splice(to..to, part);
            }
        }
    }
    bytes
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, rng_seed: RngSeed::Fixed(7), ..ProptestConfig::default() })]

    #[test]
    fn reader_random_bytes_never_panics(bytes in prop::collection::vec(any::<u8>(), 0..2000)) {
        exercise(&bytes);
        let mut packed = vec![0x1f, 0x8b];
        packed.extend_from_slice(&bytes);
        exercise(&packed);
    }

    #[test]
    fn reader_damaged_text_never_panics(all in prop::collection::vec(damage(), 1..6)) {
        let bytes = damaged(Sheet::landing().text().into_bytes(), &all);
        exercise(&bytes);
        exercise(&gzip(&bytes));
    }

    #[test]
    fn reader_damaged_gzip_never_panics(all in prop::collection::vec(damage(), 1..4)) {
        exercise(&damaged(gzip(Sheet::landing().text().as_bytes()), &all));
    }

    #[test]
    fn reader_extreme_numbers_never_panics(
        cells in prop::collection::vec((0..24_usize, 0..71_usize, any::<f64>()), 1..30)
    ) {
        let mut sheet = Sheet::landing();
        for (row, column, value) in cells {
            sheet.rows[row + 1][column] = format!("{value:?}").replace('.', ",");
        }
        exercise(sheet.text().as_bytes());
        sheet.remove_columns(|name| name.contains("Acceleration"));
        exercise(sheet.text().as_bytes());
    }
}
