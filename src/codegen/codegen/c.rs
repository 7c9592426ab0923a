//! C99: `NAME.h`, `NAME.c`, `NAME_selftest.c` and `CMakeLists.txt`.

use super::dialect::braced;
use super::script::C;
use super::test_vectors::TOLERANCE_F64;
use super::*;

#[derive(Template)]
#[template(config = "templates/askama.toml")]
enum File<'a> {
    #[template(path = "c/header.askama")]
    Header {
        banner: &'a str,
        d: &'a Dialect,
        m: &'a ModelText<'a>,
    },
    #[template(path = "c/source.askama")]
    Source {
        banner: &'a str,
        d: &'a Dialect,
        m: &'a ModelText<'a>,
        is_library: bool,
        kernel: Option<KernelText>,
        sign: bool,
        pow: bool,
        select: bool,
    },
    #[template(path = "c/cmake.askama")]
    CMake { banner: String, name: &'a str },
    #[template(path = "c/selftest.askama")]
    SelfTest {
        banner: &'a str,
        d: &'a Dialect,
        /// Of results, which have all digits in either precision.
        wide: &'a Dialect,
        latent_dim: usize,
        functions: Vec<FunctionVectors<'a>>,
    },
}

/// The C files of a model; `provenance` is the text of the first line.
pub fn emit(
    entries: &ModelInterface,
    provenance: &str,
    precision: Precision,
    sines: SineCosine,
) -> Result<Vec<EmittedFile>> {
    let name = entries.identifier.as_str();
    let d = &Dialect::new(&C, name, precision);
    let m = &ModelText::new(entries, d, Some(sines));
    let banner = &format!("/* {provenance} */");
    let source = File::Source {
        banner,
        d,
        m,
        is_library: sines == SineCosine::Library,
        kernel: (entries.has(computes_angles)).then(|| KernelText::new(d)),
        sign: entries.has(|s| matches!(s, Statement::Unary(Unary::Sign, _))),
        pow: entries.has(|s| matches!(s, Statement::Binary(Binary::Pow, ..))),
        select: entries.has(|s| matches!(s, Statement::Select(_))),
    };
    let selftest = File::SelfTest {
        banner,
        d,
        wide: &Dialect::new(&C, name, Precision::Double),
        latent_dim: entries.latent_dim,
        functions: test_vectors::all(entries, precision),
    };
    let cmake = File::CMake {
        banner: format!("# {provenance}"),
        name,
    };
    let files = [
        (format!("{name}.h"), File::Header { banner, d, m }),
        (format!("{name}.c"), source),
        (format!("{name}_selftest.c"), selftest),
        ("CMakeLists.txt".to_owned(), cmake),
    ];
    let rendered =
        |(path, file): (String, File<'_>)| Ok(EmittedFile::new(path, tidy(&file.render()?)));
    files.into_iter().map(rendered).collect()
}

/// Initialiser of an array, which cannot be empty in C.
fn numbers(values: &[usize]) -> String {
    let texts: Vec<String> = values.iter().map(usize::to_string).collect();
    match texts.is_empty() {
        true => "{0}".to_owned(),
        false => braced(&texts, "\n    "),
    }
}

/// The documented prototype for the header; `restrict` is left to the definition, so that C++ can include it.
fn prototype(d: &Dialect, function: &Function) -> String {
    let head = d.head(function).replace("restrict ", "");
    format!("{}{head};", documentation(&function.docs))
}

fn batch_prototype(d: &Dialect, phase: &str) -> String {
    let (name, real) = (&d.model, d.real());
    let docs = [
        format!("{name}_{phase}_dynamics at `count` points."),
        "Points are contiguous per variable: element k of point p is z[k * count + p], and alike \
         for dz, u_lat and ddz."
            .to_owned(),
    ];
    format!(
        "{}void {name}_{phase}_dynamics_batch(size_t count, const {real} *z, const {real} *dz,\n    \
         const {real} *u_lat, {real} *ddz);",
        documentation(&docs)
    )
}

fn documentation(lines: &[String]) -> String {
    let body: Vec<String> = comment_lines(lines, 94)
        .iter()
        .map(|line| format!(" * {}", line.replace("*/", "* /")))
        .collect();
    format!("/**\n{}\n */\n", body.join("\n"))
}

fn initialiser(d: &Dialect, rows: &[Vec<f64>]) -> String {
    let row = |row: &Vec<f64>| {
        let numbers: Vec<String> = row.iter().map(|&value| d.number(value)).collect();
        format!("\n        {}", braced(&numbers, "\n         "))
    };
    let rows: Vec<String> = rows.iter().map(row).collect();
    format!("{{{}\n    }}", rows.join(","))
}

fn argument(parameter: &ParameterVectors) -> String {
    let name = &parameter.name;
    match parameter.role {
        Role::Input => format!("{name}_in[point]"),
        Role::Scalar => format!("{name}_in[point][0]"),
        Role::Output | Role::InOut => (*name).to_owned(),
    }
}
