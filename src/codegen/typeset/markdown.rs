//! Equations for READMEs and lab notebooks, with formulas as GitHub and GitLab draw them.

use super::*;
use crate::typeset::latex::{tex, tex_symbol, tex_unit};
use crate::typeset::words::ends_line;

/// The file `NAME.md`: equations in `math` fences and the table of coefficients.
///
/// # Errors
/// [`TypesetError::Template`].
pub fn emit(equations: &Equations<'_>, options: &PrintOptions) -> Emitted {
    let page = Page::new(equations, options, &MARKDOWN);
    let path = format!("{}.md", equations.model.identifier());
    Ok(vec![EmittedFile::new(path, rendered(&Document { page })?)])
}

#[derive(Template)]
#[template(path = "markdown/page.askama", config = "templates/askama.toml")]
struct Document<'a> {
    page: Page<'a>,
}

const MARKDOWN: Spelling = Spelling {
    text: markdown_text,
    math: |math, _| format!("$`{}`$", tex(math, NumberStyle::Plain)),
};

fn after_comma(unit: &Option<Unit>) -> String {
    unit.map_or(String::new(), |unit| format!(", $`{}`$", tex_unit(unit)))
}

/// Text from outside that Markdown shows as it is, in one line.
pub(crate) fn markdown_text(text: &str) -> String {
    let mut markdown = String::new();
    for (place, character) in text.replace(ends_line, " ").chars().enumerate() {
        // A hyphen makes a list only at the start.
        let is_harmless = ".,:;%()=+/".contains(character) || (character == '-' && place > 0);
        if is_invisible(character) {
            markdown += &code_point(character);
            continue;
        }
        if character.is_ascii_punctuation() && !is_harmless {
            markdown.push('\\');
        }
        markdown.push(character);
    }
    markdown
}
