//! Names, comments and lines of C.

const WIDTH: usize = 118;

/// `IterationCap` or `write_rows` in one case: `iteration_cap`.
pub(crate) fn snake(name: &str) -> String {
    let mut out = String::new();
    for letter in name.chars() {
        if letter.is_ascii_uppercase() && !out.is_empty() && !out.ends_with('_') {
            out.push('_');
        }
        out.push(letter.to_ascii_lowercase());
    }
    out
}

/// The signs of comments in ASCII; links of rustdoc become plain words.
fn ascii(comment: &str) -> String {
    const SIGNS: &str = "⁻¹=^-1,⁻ᵀ=^-T,ᵀ=^T,½=1/2,Σ=sum of,−=-,·=.,←=<-,…=...,₀=_0,≤=<=,×=x,σ=sigma,μ=mu,γ̂=gamma,φ=phi,\
                         [`=,`]=,`=,*/=* /";
    let signs = SIGNS.split(',').filter_map(|pair| pair.split_once('='));
    signs.fold(comment.to_owned(), |text, (sign, plain)| {
        text.replace(sign, plain)
    })
}

pub(crate) fn comment(lines: &[String], indent: &str) -> String {
    if lines.is_empty() {
        return String::new();
    }
    let lines: Vec<String> = lines.iter().map(|line| ascii(line.trim())).collect();
    let text = lines.join(&format!("\n{indent} * "));
    format!("{indent}/* {} */\n", text.replace(" * \n", " *\n"))
}

/// Breaks lines that are too long behind a comma or before an operator.
pub(crate) fn wrapped(text: &str) -> String {
    let mut out = String::new();
    for line in text.lines() {
        let depth = line.len() - line.trim_start().len();
        let mut rest = line.to_owned();
        while rest.len() > WIDTH && !rest.trim_start().starts_with("/*") {
            let at = |mark: &&str| {
                let found = rest[..WIDTH.min(rest.len())].rfind(*mark)?;
                (found > depth + 12).then_some(found + usize::from(*mark == ", "))
            };
            let marks = [" || ", " && ", " ? ", " : ", ", ", " + "];
            let Some(at) = marks.iter().find_map(at) else {
                break;
            };
            out += rest[..at].trim_end();
            out.push('\n');
            rest = format!("{}{}", " ".repeat(depth + 8), rest[at..].trim_start());
        }
        out += &rest;
        out.push('\n');
    }
    out
}
