//! Text of a model file in TeX, HTML and Markdown.

use crate::typeset::latex::math::tex_text;
use crate::typeset::markdown::markdown_text;
use crate::typeset::mathml::{HtmlProse, HtmlText};

/// Characters with a special meaning in TeX.
const ACTIVE: &str = "$&#%_^~";

#[test]
fn text_escape_leaves_no_active_character_bare() {
    for hostile in [
        r"\input{x}",
        "50% of $x_1$ & #2",
        "^^5cinput",
        "~tilde_under",
        "a\\\\b",
        "}\\end{document}",
    ] {
        let text = tex_text(hostile);
        let mut previous = ' ';
        for character in text.chars() {
            assert!(!ACTIVE.contains(character) || previous == '\\', "{text}");
            previous = character;
        }
        // Every backslash begins a command of the table.
        for piece in text.split('\\').skip(1) {
            let known =
                piece.starts_with("text") || piece.starts_with(['{', '}', '$', '&', '#', '%', '_']);
            assert!(known, "{text}");
        }
    }
}

#[test]
fn text_escape_has_no_line_break_no_ligature_and_unknown_characters_by_code_point() {
    for (text, escaped) in [
        ("a\r\nb\u{2028}c\u{85}d\u{0b}e\u{0}f", "a  b c d e f"),
        ("跳 ü", "[U+8DF3] ü"),
        ("a--b-c", "a-{}-b-c"),
    ] {
        assert_eq!(tex_text(text), escaped);
    }
}

#[test]
fn symbols_become_mathematics_and_names_stay() {
    let html = |text: &str| HtmlProse(text).to_string();
    assert!(html("torque R^2 contact").contains("<math><msup>"));
    assert!(html("W_e^T u_lat").matches("<math>").count() == 2);
    assert!(html("ddz3").contains("<mover>"));
    for name in [
        "test_01", "go1-d4", "a.z1", "z1.csv", "body.x", "u-1", "k_spring", "dddz1", "ddu1", "x1",
    ] {
        assert_eq!(html(name), name);
    }
    assert_eq!(html("-"), "–");
    assert_eq!(html("-0.346"), "\u{2212}0.346");
    assert_eq!(html("1-2 <b>"), "1-2 &lt;b&gt;");
    let escaped = HtmlText("<b a=\"1\">&").to_string();
    assert_eq!(escaped, "&lt;b a=&quot;1&quot;&gt;&amp;");
}

#[test]
fn markdown_text_starts_no_link_code_html_or_mathematics() {
    let text = markdown_text("[a](b) `c` <i> $d$ |e| #f\n- g");
    assert_eq!(text, r"\[a\](b) \`c\` \<i\> \$d\$ \|e\| \#f - g");
}
