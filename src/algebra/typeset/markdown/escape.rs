//! The one way for text of a model file into Markdown.

use crate::typeset::words::ends_line;

/// Text from outside that Markdown shows as it is: punctuation is escaped, and
/// control characters become spaces, so that a text cannot start a new line.
///
/// ```
/// use romc::typeset::markdown::markdown_text;
/// assert_eq!(markdown_text("*a* <b>"), r"\*a\* \<b\>");
/// ```
pub fn markdown_text(text: &str) -> String {
    let mut markdown = String::new();
    for (place, character) in text.replace(ends_line, " ").chars().enumerate() {
        // A hyphen makes a list only at the start.
        let is_harmless = ".,:;%()=+/".contains(character) || (character == '-' && place > 0);
        if character.is_ascii_punctuation() && !is_harmless {
            markdown.push('\\');
        }
        markdown.push(character);
    }
    markdown
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn markdown_text_starts_no_link_code_html_or_mathematics() {
        let text = markdown_text("[a](b) `c` <i> $d$ |e| #f\n- g");
        assert_eq!(text, r"\[a\](b) \`c\` \<i\> \$d\$ \|e\| \#f - g");
    }
}
