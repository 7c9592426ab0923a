//! The one way for text of a model file into a page.

use std::fmt;

/// Text from outside for the content or an attribute of an element.
///
/// ```
/// use romc::typeset::mathml::HtmlText;
/// assert_eq!(HtmlText("<b a=\"1\">&").to_string(), "&lt;b a=&quot;1&quot;&gt;&amp;");
/// ```
#[derive(Clone, Copy, Debug)]
pub struct HtmlText<'a>(pub &'a str);

impl fmt::Display for HtmlText<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for character in self.0.chars() {
            match character {
                '<' => f.write_str("&lt;")?,
                '>' => f.write_str("&gt;")?,
                '&' => f.write_str("&amp;")?,
                '"' => f.write_str("&quot;")?,
                '\'' => f.write_str("&#39;")?,
                _ if character.is_control() => f.write_str(" ")?,
                _ => write!(f, "{character}")?,
            }
        }
        Ok(())
    }
}
