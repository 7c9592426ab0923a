//! A Rust crate without `std` and allocation: `NAME/Cargo.toml`, `NAME/src/lib.rs` and `NAME/tests/selftest.rs`.

use super::script::RUST;
use super::*;

#[derive(Template)]
#[template(config = "templates/askama.toml")]
enum File<'a> {
    #[template(path = "rust/cargo.askama")]
    Cargo { banner: String, name: &'a str },
    #[template(path = "rust/lib.askama")]
    Lib {
        banner: &'a str,
        d: &'a Dialect,
        m: ModelText<'a>,
        is_library: bool,
        kernel: Option<KernelText>,
    },
    #[template(path = "rust/selftest.askama")]
    SelfTest {
        banner: &'a str,
        name: &'a str,
        d: &'a Dialect,
        /// Of results, which have all digits in either precision.
        wide: &'a Dialect,
        latent_dim: usize,
        functions: Vec<FunctionVectors<'a>>,
    },
}

/// The crate of a model; `provenance` is the text of each file's first line.
pub fn emit(
    entries: &ModelInterface,
    provenance: &str,
    precision: Precision,
    sines: SineCosine,
) -> Result<Vec<EmittedFile>> {
    let name = entries.identifier.as_str();
    let d = &Dialect::new(&RUST, name, precision);
    let banner = &format!("// {provenance}");
    let lib = File::Lib {
        banner,
        d,
        m: ModelText::new(entries, d, Some(sines)),
        is_library: sines == SineCosine::Library,
        kernel: (entries.has(computes_angles)).then(|| KernelText::new(d)),
    };
    let cargo = File::Cargo {
        banner: format!("# {provenance}"),
        name,
    };
    let selftest = File::SelfTest {
        banner,
        name,
        d,
        wide: &Dialect::new(&RUST, name, Precision::Double),
        latent_dim: entries.latent_dim,
        functions: test_vectors::all(entries, precision),
    };
    let files = [
        ("Cargo.toml", cargo),
        ("src/lib.rs", lib),
        ("tests/selftest.rs", selftest),
    ];
    let rendered = |(path, file): (&str, File<'_>)| {
        let path = format!("{name}/{path}");
        Ok(EmittedFile::new(path, tidy(&file.render()?)))
    };
    files.into_iter().map(rendered).collect()
}

fn numbers(values: &[usize]) -> String {
    let texts: Vec<String> = values.iter().map(usize::to_string).collect();
    wrapped(&texts.join(", "), 90, " ").join("\n   ")
}

/// A function with its documentation; equations are in a text block, so that no markup applies.
fn documented(d: &Dialect, function: &Function) -> String {
    let mut text = String::new();
    let (equations, prose): (Vec<&String>, Vec<&String>) =
        (function.docs.iter()).partition(|line| line.starts_with("ddz"));
    for (position, paragraph) in prose.iter().enumerate() {
        if position > 0 {
            text.push_str("///\n");
        }
        for line in wrapped(paragraph, 94, " ") {
            // Brackets would be read as links.
            let line = line.trim_start().replace('[', "\\[").replace(']', "\\]");
            text.push_str(&format!("/// {line}\n"));
        }
    }
    if !equations.is_empty() {
        let lines = equations.iter().flat_map(|line| wrapped(line, 94, " "));
        let lines: String = lines.map(|line| format!("/// {line}\n")).collect();
        text.push_str(&format!("///\n/// ```text\n{lines}/// ```\n"));
    }
    text + &d.definition(function)
}

fn array(d: &Dialect, row: &[f64]) -> String {
    let numbers: Vec<String> = row.iter().map(|&value| d.number(value)).collect();
    let lines = wrapped(&numbers.join(", "), 80, " ");
    format!("[{}]", lines.join("\n           "))
}

fn argument(parameter: &ParameterVectors) -> String {
    let upper = parameter.name.to_ascii_uppercase();
    match parameter.role {
        Role::Input => format!("&{upper}_IN[point]"),
        Role::Scalar => format!("{upper}_IN[point][0]"),
        Role::Output | Role::InOut => format!("&mut {}", parameter.name),
    }
}
