//! Files that are no recordings: each error names place, found and expected.

use std::path::Path;

use romc::recording::check::{Finding, Implausible, check, without};
use romc::recording::{self, RecordingError, RecordingFault, read_from_bytes};
use romc::robot::{InputRule, RobotError};

use crate::sheet::{Sheet, gzip};

/// The error's text after the file's name, checking that it starts with it.
fn message(error: &RecordingError) -> String {
    let text = error.to_string();
    match text.strip_prefix("landing.csv: ") {
        Some(rest) => rest.to_owned(),
        None => panic!("no file name in `{text}`"),
    }
}

fn fault(sheet: &Sheet) -> RecordingError {
    sheet.read().unwrap_err()
}

#[test]
fn missing_file_is_told_with_its_path() {
    let error = recording::read(Path::new("no/such/jump.csv")).unwrap_err();
    assert_eq!(error.to_string(), "no/such/jump.csv: no such file");
}

#[test]
fn folder_instead_of_a_file_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let error = recording::read(folder.path()).unwrap_err();
    assert!(
        matches!(error.kind, RecordingFault::Io { action: "read", .. }),
        "{error:?}"
    );
    assert!(error.to_string().ends_with(": cannot read"));
}

#[test]
fn empty_and_blank_files_are_told_apart_from_headers() {
    for text in ["", "\n\n", "\u{feff}", "\r\n  \r\n"] {
        let error = read_from_bytes("landing.csv", text.as_bytes()).unwrap_err();
        assert!(message(&error).starts_with("empty file, expected a header"));
    }
    let error = read_from_bytes("landing.csv", &gzip(b"")).unwrap_err();
    assert!(message(&error).starts_with("empty file, expected a header"));
}

#[test]
fn header_without_samples_is_told() {
    let mut sheet = Sheet::landing();
    sheet.rows.truncate(1);
    let error = fault(&sheet);
    assert_eq!(message(&error), "header of 71 columns but no sample");
}

#[test]
fn header_after_a_blank_line_is_told() {
    let text = format!("\n{}", Sheet::landing().text());
    let error = read_from_bytes("landing.csv", text.as_bytes()).unwrap_err();
    assert!(
        message(&error).contains("expected cells separated by") && error.place.row() == Some(1),
        "{error:?}"
    );
}

#[test]
fn single_sample_is_too_short() {
    let mut sheet = Sheet::landing();
    sheet.rows.truncate(2);
    let error = fault(&sheet);
    assert_eq!(
        message(&error),
        "row 2: found 1 consecutive samples, expected at least 2"
    );
}

#[test]
fn time_in_milliseconds_is_told() {
    let mut sheet = Sheet::landing();
    for row in 1..sheet.rows.len() {
        sheet.set(row + 1, "Time", &(2 * row).to_string());
    }
    let error = fault(&sheet);
    let text = message(&error);
    assert!(
        text.starts_with("row 2, column `Time`: found a sample every 2 s on average"),
        "{text}"
    );
    assert!(text.ends_with("is `Time` in milliseconds?"));
}

#[test]
fn truncated_row_names_the_first_column_without_a_cell() {
    let mut sheet = Sheet::landing();
    sheet.rows[24].truncate(60);
    let error = fault(&sheet);
    assert!(
        matches!(
            error.kind,
            RecordingFault::RowLength {
                found: 60,
                expected: 71,
                ..
            }
        ) && error.place.row() == Some(25)
    );
    assert_eq!(
        message(&error),
        "row 25, column `fl.kn Torque`: found 60 cells, expected 71"
    );
}

#[test]
fn extra_cell_names_row_and_counts() {
    let mut sheet = Sheet::landing();
    sheet.rows[7].push("0".to_owned());
    let error = fault(&sheet);
    assert!(
        matches!(
            error.kind,
            RecordingFault::RowLength {
                found: 72,
                expected: 71,
                ..
            }
        ) && error.place.row() == Some(8)
    );
    assert_eq!(
        message(&error),
        "row 8, column `rl Foot`: found 72 cells, expected 71"
    );
}

#[test]
fn blank_line_between_samples_is_told() {
    let mut sheet = Sheet::landing();
    sheet.rows.insert(9, vec![String::new()]);
    let error = fault(&sheet);
    assert!(
        matches!(error.kind, RecordingFault::RowLength { found: 0, .. })
            && error.place.row() == Some(10),
        "{error:?}"
    );
}

#[test]
fn text_in_a_number_names_row_column_and_cell() {
    let mut sheet = Sheet::landing();
    sheet.set(5, "rr.hy Velocity", "fast");
    let error = fault(&sheet);
    assert_eq!(
        message(&error),
        "row 5, column `rr.hy Velocity`: found `fast`, expected a number with a decimal comma"
    );
}

#[test]
fn empty_cell_and_two_decimal_marks_are_no_numbers() {
    for cell in ["", "1.234,5", "1,2,3", "0x1F", "1 000"] {
        let mut sheet = Sheet::landing();
        sheet.set(9, "rl.kn Torque", cell);
        let error = fault(&sheet);
        let expected = format!("row 9, column `rl.kn Torque`: found `{cell}`, expected a number");
        assert!(message(&error).starts_with(&expected), "{error}");
    }
}

#[test]
fn decimal_point_among_decimal_commas_is_told() {
    let mut sheet = Sheet::landing();
    sheet.set(3, "fr.hy Position", "1.234");
    let error = fault(&sheet);
    assert!(message(&error).ends_with("found `1.234`, expected a number with a decimal comma"));
}

#[test]
fn long_cell_is_cut_in_the_message() {
    let mut sheet = Sheet::landing();
    sheet.set(3, "Time", &"x".repeat(5000));
    let text = message(&fault(&sheet));
    assert!(text.len() < 150, "{text}");
}

#[test]
fn nan_infinite_and_overflowing_numbers_are_told() {
    for cell in ["NaN", "nan", "inf", "-Infinity", "1e999"] {
        let mut sheet = Sheet::landing();
        sheet.set(12, "Body angular Velocity y", cell);
        let error = fault(&sheet);
        assert_eq!(
            message(&error),
            format!(
                "row 12, column `Body angular Velocity y`: found `{cell}`, expected a finite number"
            )
        );
    }
}

#[test]
fn differences_that_overflow_are_told() {
    let mut sheet = Sheet::landing();
    sheet.remove_columns(|name| name.contains("Acceleration"));
    sheet.set(6, "fl.hx Velocity", "1e308");
    let error = fault(&sheet);
    let text = message(&error);
    assert!(
        text.starts_with("row 5, column `fl.hx Acceleration`: found `"),
        "{text}"
    );
    assert!(
        text.ends_with(" from differences`, expected a finite number"),
        "{text}"
    );
}

#[test]
fn missing_columns_are_listed() {
    let mut sheet = Sheet::landing();
    sheet.remove_columns(|name| name == "rr.kn Torque" || name == "Body linear Position z");
    let error = fault(&sheet);
    assert_eq!(
        message(&error),
        "row 1: missing `Body linear Position z`, `rr.kn Torque`; \
         the header starts with `Time`, `fr.hx Position`, `fr.hx Velocity` and 66 more"
    );
}

#[test]
fn some_accelerations_missing_are_listed() {
    let mut sheet = Sheet::landing();
    sheet.remove_columns(|name| name == "fl.kn Acceleration");
    let error = fault(&sheet);
    assert!(message(&error).starts_with("row 1: missing `fl.kn Acceleration`;"));
}

#[test]
fn numbers_instead_of_a_header_are_told() {
    let mut sheet = Sheet::landing();
    sheet.rows.remove(0);
    let text = message(&fault(&sheet));
    assert!(
        text.starts_with("row 1: missing `Time`, `fr.hx Position`"),
        "{text}"
    );
    assert!(text.contains("the header starts with `0,"), "{text}");
}

#[test]
fn duplicate_column_names_both_places() {
    let mut sheet = Sheet::landing();
    sheet.rows[0][8] = "fr.hx Velocity".to_owned();
    let error = fault(&sheet);
    assert_eq!(
        message(&error),
        "row 1, column `fr.hx Velocity`: occurs twice, as number 3 and 9"
    );
}

#[test]
fn contact_flag_that_is_neither_0_nor_1_is_told() {
    for (cell, value) in [("2", 2.0), ("0,5", 0.5), ("-1", -1.0)] {
        let mut sheet = Sheet::landing();
        sheet.set(7, "fl Foot", cell);
        let error = fault(&sheet);
        assert_eq!(
            message(&error),
            format!(
                "row 7, column `fl Foot`: found {value}, expected contact 0 or 1 (a force? compare it with a threshold first)"
            )
        );
    }
}

#[test]
fn other_delimiters_are_told() {
    let mut sheet = Sheet::landing();
    for cell in sheet.rows.iter_mut().flatten() {
        *cell = cell.replace(',', ".");
    }
    for separator in ["|", " "] {
        sheet.separator = separator;
        let error = fault(&sheet);
        assert!(
            message(&error).contains("expected cells separated by") && error.place.row() == Some(1),
            "{error:?}"
        );
        assert!(message(&error).contains("expected cells separated by `;`, a tab or `,`"));
    }
}

#[test]
fn decimal_commas_between_commas_are_told() {
    let mut sheet = Sheet::landing();
    sheet.separator = ",";
    let error = fault(&sheet);
    assert!(matches!(error.kind, RecordingFault::RowLength { .. }) && error.place.row() == Some(2));
    assert!(message(&error).ends_with("decimal commas, cells are separated by `;`"));
}

#[test]
fn tabs_separate_and_one_too_many_is_told() {
    let mut sheet = Sheet::landing();
    sheet.separator = "\t";
    assert_eq!(sheet.read().unwrap().segments[0].len(), 24);
    sheet.set(3, "Time", "1\t2");
    assert!(matches!(
        fault(&sheet).kind,
        RecordingFault::RowLength { .. }
    ));
}

#[test]
fn row_with_another_delimiter_than_the_header_is_told() {
    let text = Sheet::landing().text().replace(',', ".");
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    lines[4] = lines[4].replace(';', ",");
    let error = read_from_bytes("landing.csv", lines.join("\n").as_bytes()).unwrap_err();
    assert!(
        message(&error).contains("expected cells separated by") && error.place.row() == Some(5),
        "{error:?}"
    );
    assert!(message(&error).ends_with("expected cells separated by `;`"));
}

#[test]
fn text_that_is_not_utf8_names_row_byte_and_value() {
    let mut bytes = Sheet::landing().text().into_bytes();
    let row_3 = bytes.iter().enumerate().filter(|(_, b)| **b == b'\n');
    let start = row_3.map(|(place, _)| place).nth(1).unwrap() + 1;
    bytes[start + 4] = 0xe9;
    let error = read_from_bytes("landing.csv", &bytes).unwrap_err();
    let text = message(&error);
    assert!(
        text.starts_with("row 3") && text.contains("found 0xe9 as byte 5"),
        "{text}"
    );
    assert_eq!(
        message(&error),
        "row 3: found 0xe9 as byte 5, expected UTF-8 text"
    );
    let utf16: Vec<u8> = "\u{feff}Time;fr"
        .encode_utf16()
        .flat_map(u16::to_le_bytes)
        .collect();
    let error = read_from_bytes("landing.csv", &utf16).unwrap_err();
    assert!(
        error.to_string().contains("found text in UTF-16"),
        "{error}"
    );
}

#[test]
fn damaged_and_truncated_gzip_are_told() {
    let packed = gzip(Sheet::landing().text().as_bytes());
    let error = read_from_bytes("landing.csv", &packed[..packed.len() - 20]).unwrap_err();
    assert!(matches!(error.kind, RecordingFault::Gzip(_)), "{error:?}");
    assert!(message(&error).ends_with("damaged gzip stream"));
    let mut flipped = packed.clone();
    let last = flipped.len() - 6;
    flipped[last] ^= 0x55;
    let error = read_from_bytes("landing.csv", &flipped).unwrap_err();
    assert!(matches!(error.kind, RecordingFault::Gzip(_)), "{error:?}");
    let error = read_from_bytes("landing.csv", &[0x1f, 0x8b, 9, 9, 9]).unwrap_err();
    assert!(
        matches!(error.kind, RecordingFault::Gzip(_)) && error.place.row() == Some(1),
        "{error:?}"
    );
}

#[test]
fn absurdly_long_line_is_refused_also_when_packed() {
    let endless = vec![b'1'; 50_000_000];
    let error = read_from_bytes("landing.csv", &endless).unwrap_err();
    assert!(message(&error).contains("found a line of more than") && error.place.row() == Some(1));
    assert!(message(&error).starts_with("row 1: found a line of more than 65536 bytes"));
    let error = read_from_bytes("landing.csv", &gzip(&endless)).unwrap_err();
    assert!(message(&error).contains("found a line of more than") && error.place.row() == Some(1));
}

#[test]
fn time_that_stands_still_or_steps_back_is_told() {
    let mut sheet = Sheet::landing();
    let before = sheet.rows[9][0].clone();
    sheet.set(11, "Time", &before);
    let error = fault(&sheet);
    assert!(
        message(&error).contains("expected a later time") && error.place.row() == Some(11),
        "{error:?}"
    );
    assert!(message(&error).contains("expected a later time or a new segment"));
    let mut sheet = Sheet::landing();
    sheet.rows.swap(10, 11);
    let error = fault(&sheet);
    assert!(
        message(&error).contains("expected a later time") && error.place.row() == Some(12),
        "{error:?}"
    );
}

#[test]
fn unknown_robot_lists_the_known_ones() {
    let error = romc::robot_file::by_name("spot").unwrap_err();
    assert!(matches!(&error, RobotError::UnknownRobot { found, .. } if found == "spot"));
    assert!(
        error
            .to_string()
            .starts_with("unknown robot `spot`; known: go1")
    );
}

#[test]
fn stretched_knee_in_contact_is_damped_and_found() {
    let go1 = romc::robot_file::by_name("go1").unwrap();
    let rule = InputRule::published(go1);
    let input = |sheet: &Sheet| sheet.read().unwrap().segments[0].input(&rule).unwrap();
    let bent = input(&Sheet::landing());
    let mut sheet = Sheet::landing();
    sheet.set(20, "rl.kn Position", "0");
    let stretched = input(&sheet);
    assert_eq!(bent.columns(0, 18), stretched.columns(0, 18));
    let force = |u: &nalgebra::DMatrix<f64>| u.fixed_view::<3, 1>(12, 18).norm();
    assert!(force(&stretched) < 10.0 * force(&bent), "{stretched}");
    let findings = check(&sheet.read().unwrap(), go1);
    let singular = |finding: &&Finding| finding.kind == Implausible::NearSingular;
    let found: Vec<&Finding> = findings.iter().filter(singular).collect();
    assert_eq!(found.len(), 1, "{findings:?}");
    assert_eq!((found[0].first_row, found[0].samples.len()), (20, 1));
    assert!(found[0].column.contains("rl.kn"), "{}", found[0]);
    // It is no reason to leave the sample out; the other findings of that row are.
    let (_, dropped) = without(&sheet.read().unwrap(), &[found[0].clone()]).unwrap();
    assert_eq!(dropped, 0);
    // The same posture in the air carries no force.
    let mut sheet = Sheet::landing();
    sheet.set(3, "rl.kn Position", "0");
    assert_eq!(input(&sheet), bent);
    let findings = check(&sheet.read().unwrap(), go1);
    assert_eq!(findings.iter().filter(singular).count(), 0);
}
