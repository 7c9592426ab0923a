//! Numbers as they are printed, and tables of them.

use crate::typeset::{Decimal, Rounding, Table, rounded, rounded_up, significant};

#[test]
fn numbers_are_rounded_by_decimals_by_significant_digits_or_as_each_needs() {
    let adaptive = Rounding::default();
    for (value, rounding, text) in [
        (-1.0, Rounding::Decimals(2), "-1.00"),
        (51.05, Rounding::Decimals(2), "51.05"),
        (0.004, Rounding::Decimals(2), "0.00"),
        (0.36, adaptive, "0.36"),
        (-1.0, adaptive, "-1.00"),
        (0.05, adaptive, "0.05"),
        (0.0537, adaptive, "0.054"),
        (0.00612, adaptive, "0.006"),
        (3.14e-9, adaptive, "3.1e-9"),
        (123456789.0, adaptive, "1.2e8"),
        (0.36, Rounding::Significant(3), "0.360"),
        (51.05, Rounding::Significant(3), "51.0"),
        (51234.0, Rounding::Significant(3), "51200"),
        (9.996, Rounding::Significant(3), "10.0"),
        (-1.25e-7, Rounding::Significant(2), "-1.2e-7"),
        (1.6e308, Rounding::Significant(1), "1.6e308"),
        (-f64::MAX, Rounding::Significant(3), "-1.79769e308"),
    ] {
        let rounded = Decimal::rounded(value, rounding).to_string();
        assert_eq!(rounded, text, "{value} by {rounding:?}");
    }
    assert_eq!(Decimal::rounded(-0.004, Rounding::Decimals(2)).value(), 0.0);
}

#[test]
fn adaptive_rounding_keeps_the_promised_relative_error() {
    let rounding = Rounding::default();
    let mut value = 1.37e-12;
    while value < 1e12 {
        let printed = Decimal::rounded(value, rounding).value();
        assert!((printed - value).abs() <= 0.05 * value, "{value} {printed}");
        value *= 1.713;
    }
}

#[test]
fn absurd_numbers_of_digits_are_cut_to_forty() {
    let digits = |rounding| Decimal::rounded(0.1, rounding).to_string().len();
    assert_eq!(digits(Rounding::Decimals(1_000_000)), 42);
    assert_eq!(digits(Rounding::Significant(1_000_000)), 42);
}

#[test]
fn exact_numbers_read_back_bit_for_bit() {
    for value in [0.1, 1.0 / 3.0, -2.5e-300, 1e22, 5e-324, 12345.678, 0.0] {
        assert_eq!(
            Decimal::rounded(value, Rounding::Exact).value().to_bits(),
            value.to_bits()
        );
    }
}

#[test]
fn numbers_keep_so_many_digits() {
    for (value, text) in [
        (0.0123449, "0.01234"),
        (12.3456, "12.35"),
        (0.0, "0"),
        (1.23456e-7, "1.235e-7"),
        (f64::NAN, "diverged"),
    ] {
        assert_eq!(significant(value), text);
    }
    assert_eq!(rounded(-0.123456, 2), -0.12);
    assert_eq!(rounded(99.6, 1), 100.0);
    assert_eq!(rounded(6.02214e23, 3), 6.02e23);
    assert_eq!(rounded(0.1 + 0.2, 17), 0.1 + 0.2);
    assert_eq!(rounded(1.6e308, 1), 1.6e308);
    assert_eq!(rounded(-f64::MAX, 4), -1.79769e308);
}

#[test]
fn rounded_up_is_never_below_and_at_most_a_unit_of_the_last_digit_above() {
    let mut value = 1.23456789e-8;
    while value < 1e6 {
        for (digits, share) in [(2, 0.11), (4, 1.1e-3)] {
            for value in [value, -value] {
                let shown = rounded_up(value, digits);
                assert!(
                    shown >= value && shown - value <= share * value.abs(),
                    "{value}"
                );
                let text = format!("{shown:.*e}", digits - 1);
                assert_eq!(text.parse(), Ok(shown), "{value}");
            }
        }
        value *= 1.0373;
    }
    assert_eq!(rounded_up(9.96e-3, 2), 1e-2);
    assert_eq!(rounded_up(0.0, 2), 0.0);
}

#[test]
fn numbers_of_a_column_have_the_same_decimals_unless_their_sizes_are_too_different() {
    let shown = |values: &[f64]| {
        let mut table = Table::default();
        table.column("row", "", (0..values.len()).map(|row| row.to_string()));
        table.column("value", "", values.to_vec());
        let text = table.to_string();
        let rows = text.lines().skip(2);
        let values = rows.map(|row| row.split_whitespace().nth(1).expect("a value").to_owned());
        values.collect::<Vec<_>>().join(" ")
    };
    assert_eq!(shown(&[0.01289, 8.127e-4]), "0.01289 0.00081");
    assert_eq!(shown(&[9.194, 13.53, 0.0]), "9.2 13.5 0");
    assert_eq!(shown(&[1.2345e9, 0.5]), "1.234e9 0.5000");
    assert_eq!(shown(&[f64::INFINITY, 1.0]), "diverged 1.00");
}

#[test]
fn a_table_that_is_too_wide_wraps_its_titles_and_then_continues_below() {
    let mut table = Table::default();
    table.column("recording", "", ["test_01"]);
    for index in 1..=12 {
        let title = format!("error of the coordinate {index:02} over the whole motion");
        table.column(&title, "m", [0.5]);
    }
    let text = table.to_string();
    assert!(
        text.lines().all(|line| line.chars().count() <= 100),
        "{text}"
    );
    assert_eq!(text.matches("test_01").count(), 2, "{text}");
    assert_eq!(text.matches("0.500").count(), 12, "{text}");
}

#[test]
fn every_rendering_has_the_same_cells() {
    let items = [("body.x", Some(0.5)), ("a|<b>, c", None)];
    let mut table = Table::of(items)
        .column("coordinate", "", |row| row.0)
        .column("rms", "m", |row| row.1)
        .table();
    table.column("count", "", [3, 12]);
    assert_eq!(
        table.to_string(),
        "  coordinate  rms, m  count\n  ----------  ------  -----\n  body.x       0.500      3\n  a|<b>, c         -     12\n"
    );
    assert_eq!(
        table.markdown(),
        "| coordinate | rms, m | count |\n|---|---|---|\n| body.x | 0.500 | 3 |\n| a\\|\\<b>, c | - | 12 |\n"
    );
    assert_eq!(
        table.csv(),
        "coordinate,rms,count\nbody.x,0.5000,3\n\"a|<b>, c\",-,12\n"
    );
    let mut by_columns = Table::default();
    by_columns.column("coordinate", "", ["body.x", "a|<b>, c"]);
    by_columns.column("rms", "m", [Some(0.5), None]);
    assert_eq!(*by_columns.column("count", "", [3, 12]), table);
    let html = table.captioned("Errors & more").html();
    assert!(html.starts_with("<table>\n<caption>Errors &amp; more</caption>\n<thead><tr><th scope=\"col\">coordinate</th>"), "{html}");
    assert!(
        html.contains("<tr><th scope=\"row\">a|&lt;b&gt;, c</th><td>–</td><td>12</td></tr>\n"),
        "{html}"
    );
}
