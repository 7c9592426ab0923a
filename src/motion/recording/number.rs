//! Cells as numbers, with a decimal point or a decimal comma.

#[derive(Clone, Copy, Debug, PartialEq)]
enum Mark {
    Point,
    Comma,
}

/// Reads cells, and learns the file's decimal mark from them.
#[derive(Debug)]
pub(super) struct NumberReader {
    /// The first one met holds for the rest.
    mark: Option<Mark>,
    /// A cell with its comma replaced, kept to spare an allocation a cell.
    pointed: String,
}

impl NumberReader {
    /// Of cells that are separated by this character: between commas the mark is a point.
    pub(crate) fn new(delimiter: char) -> Self {
        NumberReader {
            mark: (delimiter == ',').then_some(Mark::Point),
            pointed: String::new(),
        }
    }

    pub(crate) fn expected(&self) -> &'static str {
        match self.mark {
            None => "a number",
            Some(Mark::Point) => "a number with a decimal point",
            Some(Mark::Comma) => "a number with a decimal comma",
        }
    }

    /// The value of a cell, or `None` if it is no number in this notation.
    /// May be infinite or NaN.
    pub(crate) fn parse(&mut self, cell: &str) -> Option<f64> {
        let Some(place) = cell.bytes().position(|b| b == b'.' || b == b',') else {
            return cell.parse().ok();
        };
        let found = match cell.as_bytes()[place] {
            b'.' => Mark::Point,
            _ => Mark::Comma,
        };
        if self.mark.is_some_and(|mark| mark != found) {
            return None;
        }
        let pointed = match found {
            Mark::Comma => {
                // A second mark of either kind fails to parse.
                self.pointed.clear();
                self.pointed
                    .extend([&cell[..place], ".", &cell[place + 1..]]);
                &self.pointed
            }
            Mark::Point => cell,
        };
        let value = pointed.parse().ok()?;
        self.mark = Some(found);
        Some(value)
    }
}
