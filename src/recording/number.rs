//! Cells as numbers, with a decimal point or a decimal comma.

/// The decimal mark of a file: the first one met holds for the rest.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum DecimalMark {
    Unknown,
    Point,
    Comma,
}

impl DecimalMark {
    /// What a number looks like, for messages.
    pub fn expected(self) -> &'static str {
        match self {
            DecimalMark::Unknown => "a number",
            DecimalMark::Point => "a number with a decimal point",
            DecimalMark::Comma => "a number with a decimal comma",
        }
    }

    /// The value of a cell, or `None` if it is no number in this notation.
    /// May be infinite or NaN. Learns the mark from the first cell that has one.
    pub fn parse(&mut self, cell: &str) -> Option<f64> {
        let Some(place) = cell.bytes().position(|b| b == b',') else {
            if *self == DecimalMark::Comma && cell.contains('.') {
                return None;
            }
            let value = cell.parse().ok()?;
            if cell.contains('.') {
                *self = DecimalMark::Point;
            }
            return Some(value);
        };
        // The longest decimal text that a double needs is far below this.
        const LONGEST: usize = 400;
        if *self == DecimalMark::Point || cell.len() > LONGEST || cell.contains('.') {
            return None;
        }
        let mut buffer = [0_u8; LONGEST];
        let text = &mut buffer[..cell.len()];
        text.copy_from_slice(cell.as_bytes());
        text[place] = b'.';
        let value = std::str::from_utf8(text).ok()?.parse().ok()?;
        *self = DecimalMark::Comma;
        Some(value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parse_reads_either_mark_and_keeps_to_the_first() {
        let mut mark = DecimalMark::Unknown;
        assert_eq!(mark.parse("3"), Some(3.0));
        assert_eq!(mark, DecimalMark::Unknown);
        assert_eq!(mark.parse("-1,5e-3"), Some(-0.0015));
        assert_eq!(mark, DecimalMark::Comma);
        assert_eq!(mark.parse("1.5"), None);
        let mut mark = DecimalMark::Unknown;
        assert_eq!(mark.parse("1.5"), Some(1.5));
        assert_eq!(mark.parse("1,5"), None);
    }

    #[test]
    fn parse_text_thousands_and_two_marks_are_no_numbers() {
        for cell in [
            "", "x", "1.234,5", "1,234,5", "1 2", "0x10", "--1", ",", "1,é",
        ] {
            assert_eq!(DecimalMark::Unknown.parse(cell), None, "{cell}");
        }
        assert_eq!(
            DecimalMark::Unknown.parse(&format!("1,{}", "0".repeat(500))),
            None
        );
    }

    #[test]
    fn parse_not_finite_text_is_returned_for_the_caller_to_refuse() {
        assert!(DecimalMark::Unknown.parse("NaN").unwrap().is_nan());
        assert_eq!(DecimalMark::Unknown.parse("1e999"), Some(f64::INFINITY));
    }
}
