//! Curves over time as characters, for terminals.

const WIDTH: usize = 60;
const HEIGHT: usize = 5;

/// Curves of values at equal distances of time, one character each; where they meet the last is drawn. The axis has the
/// least and the largest value, with so many decimals.
pub(super) fn chart(curves: &[(char, Vec<f64>)], decimals: usize) -> String {
    let finite = (curves.iter()).flat_map(|(_, values)| values.iter().copied());
    let finite = finite.filter(|value| value.is_finite());
    let (low, high) = finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
        (low.min(value), high.max(value))
    });
    if low >= high {
        return String::new();
    }
    let mut rows = vec![vec![' '; WIDTH]; HEIGHT];
    for (mark, values) in curves.iter().filter(|(_, values)| !values.is_empty()) {
        for column in 0..WIDTH {
            let value = values[column * (values.len() - 1) / (WIDTH - 1)];
            if value.is_finite() {
                let height = (value - low) / (high - low) * (HEIGHT - 1) as f64;
                rows[HEIGHT - 1 - height.round() as usize][column] = *mark;
            }
        }
    }
    let label = |row: usize| match row {
        0 => format!("{high:.decimals$}"),
        row if row + 1 == HEIGHT => format!("{low:.decimals$}"),
        _ => String::new(),
    };
    let width = label(0).len().max(label(HEIGHT - 1).len());
    let line = |(row, cells): (usize, &Vec<char>)| {
        let cells: String = cells.iter().collect();
        format!("  {:>width$} |{}\n", label(row), cells.trim_end())
    };
    rows.iter().enumerate().map(line).collect()
}

#[cfg(test)]
mod tests {
    use super::chart;

    #[test]
    fn a_rising_curve_goes_from_the_lower_left_to_the_upper_right() {
        let text = chart(&[('*', vec![0.0, 1.0, 2.0])], 1);
        let lines: Vec<&str> = text.lines().collect();
        assert!(
            lines[0].starts_with("  2.0 |") && lines[0].ends_with('*'),
            "{text}"
        );
        assert!(lines[4].starts_with("  0.0 |*"), "{text}");
        assert_eq!(lines[0].chars().count(), "  2.0 |".len() + 60);
    }

    #[test]
    fn a_curve_that_diverges_is_drawn_up_to_there() {
        let text = chart(&[('*', vec![0.0, 1.0, f64::NAN])], 1);
        assert_eq!(text.matches('*').count(), 59);
        assert_eq!(chart(&[('*', vec![1.0, 1.0])], 1), "");
    }
}
