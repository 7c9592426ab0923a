//! Notations of the same numbers that all read alike.

use romc::recording::{self, Recording, read_from_bytes};

use crate::sheet::{Sheet, gzip};

fn landing() -> Recording {
    Sheet::landing().read().unwrap()
}

#[test]
fn landing_fixture_has_the_numbers_of_its_text() {
    let recording = landing();
    assert_eq!(recording.segments.len(), 1);
    let segment = &recording.segments[0];
    assert_eq!((segment.len(), segment.first_row), (24, 2));
    let sheet = Sheet::landing();
    let cell = |row: usize, column: &str| -> f64 {
        let text = &sheet.rows[row - 1][sheet.place(column)];
        text.replace(',', ".").parse().unwrap()
    };
    for sample in 0..24 {
        let row = sample + 2;
        assert_eq!(segment.time_s[sample], cell(row, "Time"));
        assert_eq!(segment.x[(5, sample)], cell(row, "fl.kn Position"));
        assert_eq!(segment.dx[(0, sample)], cell(row, "fr.hx Velocity"));
        assert_eq!(
            segment.ddx[(14, sample)],
            cell(row, "Body linear Acceleration z")
        );
        assert_eq!(
            segment.x[(16, sample)],
            cell(row, "Body angular Position y")
        );
        assert_eq!(segment.torque_nm[(11, sample)], cell(row, "rl.kn Torque"));
        assert_eq!(segment.feet[sample][2], cell(row, "rr Foot") == 1.0);
    }
    assert_eq!(segment.feet[0], [false; 4]);
    assert_eq!(segment.feet[10], [true, false, true, false]);
    assert_eq!(segment.feet[23], [true; 4]);
}

#[test]
fn comma_separated_with_decimal_point_reads_alike() {
    let mut sheet = Sheet::landing();
    sheet.separator = ",";
    for cell in sheet.rows.iter_mut().flatten() {
        *cell = cell.replace(',', ".");
    }
    assert_eq!(sheet.read().unwrap(), landing());
}

#[test]
fn semicolons_with_decimal_point_read_alike() {
    let text = Sheet::landing().text().replace(',', ".");
    let recording = read_from_bytes("landing.csv", text.as_bytes()).unwrap();
    assert_eq!(recording, landing());
}

#[test]
fn byte_order_mark_crlf_blanks_and_quotes_read_alike() {
    let mut sheet = Sheet::landing();
    for cell in &mut sheet.rows[0] {
        *cell = format!("\"{cell}\"");
    }
    for cell in &mut sheet.rows[3] {
        *cell = format!(" {cell}\t");
    }
    let text = format!("\u{feff}{}\n \n", sheet.text()).replace('\n', "\r\n");
    let recording = read_from_bytes("landing.csv", text.as_bytes()).unwrap();
    assert_eq!(recording, landing());
}

#[test]
fn columns_in_any_order_read_alike() {
    let mut sheet = Sheet::landing();
    for row in &mut sheet.rows {
        row.reverse();
        row.swap(3, 40);
    }
    assert_eq!(sheet.read().unwrap(), landing());
}

#[test]
fn gzip_in_one_or_two_members_reads_alike() {
    let text = Sheet::landing().text();
    let whole = read_from_bytes("landing.csv", &gzip(text.as_bytes())).unwrap();
    assert_eq!(whole, landing());
    let (head, tail) = text.as_bytes().split_at(5000);
    let members = [gzip(head), gzip(tail)].concat();
    let chained = read_from_bytes("landing.csv", &members).unwrap();
    assert_eq!(chained, landing());
}

#[test]
fn columns_that_the_format_does_not_know_are_named_and_left_out() {
    let mut sheet = Sheet::landing();
    for (index, row) in sheet.rows.iter_mut().enumerate() {
        row.insert(5, if index == 0 { "Battery" } else { "full" }.to_owned());
    }
    let mut recording = sheet.read().unwrap();
    assert_eq!(recording.ignored_columns, ["Battery"]);
    recording.ignored_columns.clear();
    assert_eq!(recording, landing());
}

#[test]
fn accelerations_absent_are_differences_of_velocities() {
    let mut sheet = Sheet::landing();
    sheet.remove_columns(|name| name.contains("Acceleration"));
    let found = sheet.read().unwrap();
    let segment = &found.segments[0];
    for coordinate in 0..18 {
        for sample in 1..23 {
            let rise = segment.dx[(coordinate, sample + 1)] - segment.dx[(coordinate, sample - 1)];
            let expected = rise / (segment.time_s[sample + 1] - segment.time_s[sample - 1]);
            let error = (segment.ddx[(coordinate, sample)] - expected).abs();
            assert!(
                error < 1e-9 * (1.0 + expected.abs()),
                "{coordinate} {sample}"
            );
        }
    }
}

#[test]
fn force_columns_become_the_wrench() {
    let mut sheet = Sheet::landing();
    for (index, row) in sheet.rows.iter_mut().enumerate() {
        for part in ["linear", "angular"] {
            for axis in ["x", "y", "z"] {
                row.push(match index {
                    0 => format!("Body {part} Force {axis}"),
                    _ => format!("{index},5"),
                });
            }
        }
    }
    let recording = sheet.read().unwrap();
    let wrench = recording.segments[0].body_wrench.as_ref().unwrap();
    assert_eq!(wrench.shape(), (6, 24));
    assert_eq!((wrench[(0, 0)], wrench[(5, 23)]), (1.5, 24.5));
}

#[test]
fn time_that_jumps_back_starts_a_segment() {
    let mut sheet = Sheet::landing();
    let again = sheet.rows[1..].to_vec();
    sheet.rows.extend(again);
    let recording = sheet.read().unwrap();
    let single = landing();
    assert_eq!(recording.segments.len(), 2);
    assert_eq!(recording.segments[0], single.segments[0]);
    assert_eq!(recording.segments[1].first_row, 26);
    assert_eq!(recording.segments[1].x, single.segments[0].x);
}

#[test]
fn time_that_leaps_ahead_starts_a_segment() {
    let mut sheet = Sheet::landing();
    for index in 13..=24 {
        let time = 5.0 + 0.002 * index as f64;
        sheet.set(index + 1, "Time", &format!("{time}").replace('.', ","));
    }
    let recording = sheet.read().unwrap();
    let lengths: Vec<usize> = recording.segments.iter().map(|s| s.len()).collect();
    assert_eq!(lengths, [12, 12]);
    assert_eq!(recording.segments[1].first_row, 14);
}

#[test]
fn time_steps_of_resampled_phases_are_accepted() {
    let mut sheet = Sheet::landing();
    for index in 0..24 {
        let time = 0.001185 * index as f64 + if index % 2 == 0 { 0.0 } else { 1e-5 };
        sheet.set(index + 2, "Time", &format!("{time}").replace('.', ","));
    }
    assert_eq!(sheet.read().unwrap().segments.len(), 1);
}

#[test]
fn written_recording_reads_back_equal() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("landing.csv");
    let mut expected = landing();
    expected.path = path.clone();
    expected.segments[0].path = path.clone();
    recording::write(&path, &expected).unwrap();
    assert_eq!(recording::read(&path).unwrap(), expected);
}

#[test]
fn clocks_that_count_from_an_epoch_count_from_the_first_sample() {
    let mut sheet = Sheet::landing();
    let place = sheet.place("Time");
    for row in &mut sheet.rows[1..] {
        let time: f64 = row[place].replace(',', ".").parse().expect("a number");
        row[place] = format!("{:.6}", 1.7e9 + time).replace('.', ",");
    }
    let (read, right) = (sheet.read().unwrap(), landing());
    let (read, right) = (&read.segments[0].time_s, &right.segments[0].time_s);
    assert_eq!(read[0], 0.0);
    for (read, right_s) in read.iter().zip(right) {
        assert!((read - (right_s - right[0])).abs() < 1e-6);
    }
}

/// Samples every 2 ms, each stamped in another notation of dates.
#[test]
fn dates_of_every_kind_are_seconds_since_1970() {
    let read = |times: &[&str]| {
        let mut sheet = Sheet::landing();
        sheet.rows.truncate(1 + times.len());
        (times.iter().zip(2..)).for_each(|(time, row)| sheet.set(row, "Time", time));
        sheet.read()
    };
    for times in [
        &[
            "2024-02-29T23:59:59.998Z",
            "2024-03-01 00:00:00,000",
            "2024-03-01T02:00:00.002+02:00",
            "2024-02-29T22:30:00.004-0130",
            "2024/03/01 00:00:00.006",
        ][..],
        &["2000-02-29T23:59:59.999", "2000-03-01T00:00:00.001"],
        &["2023-02-28T23:59:59.999", "2023-03-01T00:00:00.001"],
        &["1999-12-31T23:59:59.999", "2000-01-01T00:00:00.001"],
        &["1970-01-01T00:00:00Z", "1970-01-01T00:00:00.002Z"],
        &["00:59:59.999999999", "01:00:00.001999999"],
    ] {
        let found = read(times).unwrap().segments.remove(0).time_s;
        for (i, time) in found.iter().enumerate() {
            let expected = 0.002 * i as f64;
            let is_exact = (time - found[0] - expected).abs() < 1e-11;
            assert!(is_exact, "{} is {time}, not {expected}", times[i]);
        }
    }
    // Nanoseconds of an epoch.
    let found = read(&[
        "2023-11-14T22:13:20.123456789Z",
        "2023-11-14T22:13:20.125456790Z",
    ]);
    let found = found.unwrap().segments.remove(0).time_s;
    assert!((found[1] - 0.002_000_001).abs() < 1e-15, "{found:?}");
    for text in "2024-13-01T00:00:00|2024-01-01T|a:b|1:2:3:4|1:2:3+x|-1:00:00".split('|') {
        let error = read(&[text, "00:00:01"]).unwrap_err().to_string();
        assert!(error.contains("row 2, column `Time`: found `"), "{error}");
    }
}
