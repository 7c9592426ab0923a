//! The one way for text of a model file into Markdown.

use std::fmt;

/// Text from outside that Markdown shows as it is: punctuation is escaped, and
/// control characters become spaces, so that a text cannot start a new line.
///
/// ```
/// use romc::typeset::markdown::MarkdownText;
/// assert_eq!(MarkdownText("*a* <b>").to_string(), r"\*a\* \<b\>");
/// ```
#[derive(Clone, Copy, Debug)]
pub struct MarkdownText<'a>(pub &'a str);

impl fmt::Display for MarkdownText<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (place, character) in self.0.chars().enumerate() {
            // A hyphen makes a list only at the start.
            let is_harmless = ".,:;%()=+/".contains(character) || (character == '-' && place > 0);
            if character.is_control() || matches!(character, '\u{2028}' | '\u{2029}') {
                f.write_str(" ")?;
            } else if character.is_ascii_punctuation() && !is_harmless {
                write!(f, "\\{character}")?;
            } else {
                write!(f, "{character}")?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn markdown_text_starts_no_link_code_html_or_mathematics() {
        let text = MarkdownText("[a](b) `c` <i> $d$ |e| #f\n- g").to_string();
        assert_eq!(text, r"\[a\](b) \`c\` \<i\> \$d\$ \|e\| \#f - g");
    }
}
