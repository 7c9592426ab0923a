//! Breaking lists and comments into lines.

/// `{a, b, c}`, broken with `indent` after every eight elements of a long list; an `indent`
/// without a newline leaves breaking to the printer.
pub(crate) fn braced(elements: &[String], indent: &str) -> String {
    let lines: Vec<String> = elements.chunks(8).map(|line| line.join(", ")).collect();
    format!("{{{}}}", lines.join(&format!(",{indent}")))
}

/// Each paragraph as [`wrapped`]; continued lines are indented by two spaces.
pub(crate) fn comment_lines(paragraphs: &[String], width: usize) -> Vec<String> {
    let paragraphs = paragraphs.iter();
    paragraphs
        .flat_map(|text| wrapped(text, width, " "))
        .collect()
}

/// A paragraph broken at spaces into lines of at most `width` bytes where possible; continued lines
/// begin with `indent`, which a space follows if it is not empty.
pub fn wrapped(paragraph: &str, width: usize, indent: &str) -> Vec<String> {
    let mut lines = Vec::new();
    let mut line = String::new();
    for word in paragraph.split_whitespace() {
        if !line.is_empty() && line.len() + 1 + word.len() > width {
            lines.push(std::mem::replace(&mut line, indent.to_owned()));
        }
        if !line.is_empty() {
            line.push(' ');
        }
        line.push_str(word);
    }
    lines.push(line);
    lines
}

/// The text without trailing spaces or several blank lines in a row, ending with one newline.
pub fn tidy(text: &str) -> String {
    // Line by line into one buffer: a file has up to ten megabytes.
    let mut tidied = String::with_capacity(text.len() + 1);
    for line in text.lines().map(str::trim_end) {
        if !line.is_empty() || !(tidied.is_empty() || tidied.ends_with("\n\n")) {
            tidied.push_str(line);
            tidied.push('\n');
        }
    }
    tidied.truncate(tidied.trim_end_matches('\n').len() + 1);
    tidied
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_keep_paragraphs_and_tidy_text_has_single_blank_lines_and_one_newline_at_its_end() {
        let lines = comment_lines(&["one two three".to_owned(), "four".to_owned()], 9);
        assert_eq!(lines, ["one two", "  three", "four"]);
        for (text, tidied) in [
            ("", ""),
            ("\n \n", ""),
            ("a", "a\n"),
            ("\n\na  \n\n \nb\n\n", "a\n\nb\n"),
        ] {
            assert_eq!(tidy(text), tidied, "{text:?}");
        }
    }
}
