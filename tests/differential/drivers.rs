//! Compiles generated code of many models into one program and runs it on many points;
//! numbers pass as their bits through files.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use romc::codegen::Precision;
use romc::deploy::{EmitOptions, Target, emit};
use romc::equations::Equations;
use romc::files::Overwrite;
use romc::files::write_files;
use romc::lower::Form;
use romc::model::ReducedModel;

use super::agreement::Rule;
use super::driver_text::{c_driver, rust_driver};
use super::functions::Function;
use super::tools::{has, has_compiler_with};

/// A folder with the generated code of some models.
pub struct Workshop {
    folder: tempfile::TempDir,
    models: Vec<String>,
    precision: Precision,
}

impl Workshop {
    pub fn new(models: &[ReducedModel], form: Form) -> Self {
        Self::in_precision(models, form, Precision::Double)
    }

    pub fn in_precision(models: &[ReducedModel], form: Form, precision: Precision) -> Self {
        let options = EmitOptions {
            form,
            precision,
            ..EmitOptions::default()
        };
        let folder = tempfile::tempdir().expect("a temporary folder");
        for model in models {
            let files = emit(&Equations::of(model), &[Target::C, Target::Rust], &options);
            let files = files.unwrap_or_else(|error| panic!("{}: {error}", model.name()));
            let own = folder.path().join(model.identifier().as_str());
            write_files(&own, &files, Overwrite::Refuse).expect("written");
        }
        Self {
            folder,
            models: models
                .iter()
                .map(|model| model.identifier().to_string())
                .collect(),
            precision,
        }
    }

    pub fn path(&self) -> &Path {
        self.folder.path()
    }

    /// Runs the functions as `build` compiles them. Builds of one folder may run side by side.
    pub fn run(&self, build: &Build, functions: &[Function], points: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let program = match &build.compiler {
            Compiler::C { command, flags } => self.compile_c(build, command, flags, functions),
            Compiler::Rust { library } => self.compile_rust(build, *library, functions),
        };
        self.run_program(&program, build, functions, points)
    }

    fn compile_c(
        &self,
        build: &Build,
        compiler: &str,
        flags: &[&str],
        functions: &[Function],
    ) -> PathBuf {
        let program = self.path().join(build.file_name());
        let driver = program.with_extension("c");
        let text = c_driver(&self.models, functions);
        let text = match self.precision {
            Precision::Double => text,
            Precision::Single => text.replace("double", "float"),
        };
        fs::write(&driver, text).expect("written");
        let sources = self
            .models
            .iter()
            .map(|model| self.path().join(model).join(format!("{model}.c")));
        succeed(
            Command::new(compiler)
                .args(C_WARNINGS)
                .args(flags)
                .arg("-I")
                .arg(self.path())
                .arg(driver)
                .args(sources)
                .arg("-o")
                .arg(&program)
                .arg("-lm"),
        );
        program
    }

    /// Each crate becomes a module of one program.
    fn compile_rust(&self, build: &Build, library: MathLibrary, functions: &[Function]) -> PathBuf {
        let mut source = String::from(
            "#![allow(non_snake_case, clippy::all, unused_imports)]\n#![deny(warnings)]\n",
        );
        for model in &self.models {
            let path = self.path().join(model).join(model).join("src/lib.rs");
            let text = fs::read_to_string(path).expect("emitted");
            let inner = |line: &&str| !line.starts_with("#![") && !line.starts_with("//!");
            let body: Vec<&str> = text.lines().filter(inner).collect();
            source.push_str(&format!(
                "#[allow(dead_code)]\nmod {model} {{\n{}\n}}\n",
                body.join("\n")
            ));
        }
        source.push_str(&match self.precision {
            Precision::Double => rust_driver(functions),
            Precision::Single => rust_driver(functions)
                .replace("f64", "f32")
                .replace("chunks_exact(8)", "chunks_exact(4)"),
        });
        let program = self.path().join(build.file_name());
        let driver = program.with_extension("rs");
        fs::write(&driver, source).expect("written");
        let rustc = std::env::var("RUSTC").unwrap_or_else(|_| "rustc".to_owned());
        let mut command = Command::new(rustc);
        command.args([
            "--edition",
            "2021",
            "-C",
            "opt-level=1",
            "-C",
            "debug-assertions=on",
        ]);
        command.args([
            "--check-cfg",
            "cfg(feature, values(\"std\", \"libm\"))",
            "--check-cfg",
            "cfg(test)",
        ]);
        match library {
            MathLibrary::Std => command.args(["--cfg", "feature=\"std\""]),
            MathLibrary::Libm => command
                .args(["--cfg", "feature=\"libm\"", "--extern"])
                .arg(format!("libm={}", libm().display())),
        };
        succeed(command.arg(driver).arg("-o").arg(&program));
        program
    }

    /// Compiles the C self-test of a model, which also compares batches, and runs it.
    pub fn run_c_selftest(&self, build: &Build, model: &str) {
        let Compiler::C { command, flags } = &build.compiler else {
            panic!("{} is no build of C", build.name);
        };
        let folder = self.path().join(model);
        let program = folder.join(format!("selftest{}", build.file_name()));
        succeed(
            Command::new(command)
                .args(C_WARNINGS)
                .args(flags)
                .args([
                    folder.join(format!("{model}.c")),
                    folder.join(format!("{model}_selftest.c")),
                ])
                .arg("-o")
                .arg(&program)
                .arg("-lm"),
        );
        succeed(&mut build.command(&program));
    }

    /// Compiles and runs the tests of a model's crate, without a package registry.
    pub fn run_rust_selftest(&self, model: &str) {
        let folder = self.path().join(model).join(model);
        let library = folder.join(format!("lib{model}.rlib"));
        let program = folder.join("selftest");
        let rustc = || {
            let mut command =
                Command::new(std::env::var("RUSTC").unwrap_or_else(|_| "rustc".to_owned()));
            command.args(["--edition", "2021", "-D", "warnings", "-C", "opt-level=1"]);
            command.args([
                "--check-cfg",
                "cfg(feature, values(\"std\", \"libm\"))",
                "--check-cfg",
                "cfg(test)",
            ]);
            command
        };
        succeed(
            rustc()
                .args(["--crate-type", "lib", "--cfg", "feature=\"std\""])
                .args(["--crate-name", model])
                .arg(folder.join("src/lib.rs"))
                .arg("-o")
                .arg(&library),
        );
        succeed(
            rustc()
                .arg("--test")
                .arg(folder.join("tests/selftest.rs"))
                .arg("--extern")
                .arg(format!("{model}={}", library.display()))
                .arg("-o")
                .arg(&program),
        );
        succeed(&mut Command::new(program));
    }

    fn run_program(
        &self,
        program: &Path,
        build: &Build,
        functions: &[Function],
        points: &[Vec<f64>],
    ) -> Vec<Vec<f64>> {
        let inputs = program.with_extension("inputs");
        let outputs = program.with_extension("outputs");
        let bytes: Vec<u8> = points
            .iter()
            .flatten()
            .flat_map(|&x| match self.precision {
                Precision::Double => x.to_ne_bytes().to_vec(),
                Precision::Single => (x as f32).to_ne_bytes().to_vec(),
            })
            .collect();
        fs::write(&inputs, bytes).expect("written");
        succeed(build.command(program).arg(&inputs).arg(&outputs));
        let bytes = fs::read(outputs).expect("the driver wrote its results");
        let width = match self.precision {
            Precision::Double => 8,
            Precision::Single => 4,
        };
        let mut numbers = bytes.chunks_exact(width).map(|bytes| match self.precision {
            Precision::Double => f64::from_ne_bytes(bytes.try_into().expect("eight bytes")),
            Precision::Single => {
                f64::from(f32::from_ne_bytes(bytes.try_into().expect("four bytes")))
            }
        });
        let results: Vec<Vec<f64>> = functions
            .iter()
            .map(|function| {
                let len = function.n_points * function.output_len();
                numbers.by_ref().take(len).collect()
            })
            .collect();
        let found: usize = results.iter().map(Vec::len).sum();
        assert_eq!(found * width, bytes.len(), "the driver wrote every result");
        results
    }
}

const C_WARNINGS: [&str; 7] = [
    "-std=c99",
    "-Wall",
    "-Wextra",
    "-Wconversion",
    "-Wshadow",
    "-pedantic",
    "-Werror",
];

/// A way to compile generated code, and how its results are judged.
#[derive(Clone, Debug)]
pub struct Build {
    pub name: &'static str,
    pub compiler: Compiler,
    pub rule: Rule,
    /// The command that its programs run under, as valgrind; none if empty.
    pub under: &'static [&'static str],
}

#[derive(Clone, Debug)]
pub enum Compiler {
    C {
        command: String,
        flags: Vec<&'static str>,
    },
    Rust {
        library: MathLibrary,
    },
}

/// Where a generated crate finds elementary functions.
#[derive(Clone, Copy, Debug)]
pub enum MathLibrary {
    /// The standard library.
    Std,
    /// The crate of that name, for targets without the standard library.
    Libm,
}

impl Build {
    /// The C compiler of the machine, `CC` or `cc`, without contraction.
    pub fn c() -> Self {
        Self::c_of(
            "C, -O1 -ffp-contract=off",
            cc(),
            &["-O1", "-ffp-contract=off"],
        )
    }

    pub fn c_fast() -> Self {
        let flags = ["-O3", "-march=native", "-ffp-contract=fast"];
        Self {
            rule: Rule::UlpsATerm,
            ..Self::c_of("C, -O3 -march=native, contracted", cc(), &flags)
        }
    }

    pub fn rust() -> Self {
        Self {
            name: "Rust",
            compiler: Compiler::Rust {
                library: MathLibrary::Std,
            },
            rule: Rule::SameBits,
            under: &[],
        }
    }

    pub fn rust_libm() -> Self {
        Self {
            name: "Rust with libm",
            compiler: Compiler::Rust {
                library: MathLibrary::Libm,
            },
            rule: Rule::UlpsATerm,
            under: &[],
        }
    }

    /// Clang without contraction.
    fn clang() -> Option<Self> {
        let flags = ["-O1", "-ffp-contract=off"];
        has("clang").then(|| Self::c_of("clang, -O1 -ffp-contract=off", "clang".to_owned(), &flags))
    }

    /// Clang with contraction.
    fn clang_fast() -> Option<Self> {
        let flags = ["-O2", "-march=native", "-ffp-contract=fast"];
        has("clang").then(|| Self {
            rule: Rule::UlpsATerm,
            ..Self::c_of(
                "clang, -O2 -march=native, contracted",
                "clang".to_owned(),
                &flags,
            )
        })
    }

    /// The builds that must have the interpreter's bits.
    pub fn exact() -> Vec<Self> {
        let mut exact = vec![Self::rust(), Self::c()];
        exact.extend(Self::clang());
        exact
    }

    pub fn all() -> Vec<Self> {
        let mut all = Self::exact();
        all.extend(Self::inexact());
        all
    }

    /// The builds that may round otherwise than the interpreter.
    pub fn inexact() -> Vec<Self> {
        let mut inexact = vec![Self::c_fast(), Self::rust_libm()];
        inexact.extend(Self::clang_fast());
        inexact
    }

    /// As a user compiles it.
    pub fn c_plain() -> Self {
        Self::c_with("C, -O2", &["-O2"])
    }

    /// With sanitizers of addresses and of undefined behaviour; the first finding ends the program.
    pub fn sanitized() -> Option<Self> {
        let flags = [
            "-O1",
            "-g",
            "-ffp-contract=off",
            "-fsanitize=address,undefined",
            "-fno-sanitize-recover=all",
        ];
        has_compiler_with(&cc(), &flags).then(|| Self::c_with("C, sanitized", &flags))
    }

    /// Under valgrind.
    pub fn valgrind() -> Option<Self> {
        has("valgrind").then(|| Self {
            under: &["valgrind", "-q", "--error-exitcode=9", "--leak-check=full"],
            ..Self::c_with("C, valgrind", &["-O1", "-g", "-ffp-contract=off"])
        })
    }

    /// The command that runs a program of this build.
    fn command(&self, program: &Path) -> Command {
        match self.under {
            [] => Command::new(program),
            [tool, arguments @ ..] => {
                let mut command = Command::new(tool);
                command.args(arguments).arg(program);
                command
            }
        }
    }

    /// The C compiler of the machine with flags.
    pub fn c_with(name: &'static str, flags: &[&'static str]) -> Self {
        Self::c_of(name, cc(), flags)
    }

    fn c_of(name: &'static str, command: String, flags: &[&'static str]) -> Self {
        let flags = flags.to_vec();
        Self {
            name,
            compiler: Compiler::C { command, flags },
            rule: Rule::SameBits,
            under: &[],
        }
    }

    fn file_name(&self) -> String {
        self.name
            .chars()
            .filter(char::is_ascii_alphanumeric)
            .collect()
    }
}

/// The C compiler of the machine.
pub fn cc() -> String {
    std::env::var("CC").unwrap_or_else(|_| "cc".to_owned())
}

/// The crate `libm` as cargo compiled it for this test.
fn libm() -> PathBuf {
    let test = std::env::current_exe().expect("a test is a program");
    let folder = test.parent().expect("it is in a folder");
    let is_libm = |path: &PathBuf| {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        name.starts_with("liblibm-") && name.ends_with(".rlib")
    };
    let found = fs::read_dir(folder)
        .expect("a folder")
        .map(|entry| entry.expect("an entry").path())
        .filter(is_libm);
    // The newest, should older ones of another compiler be left in the folder.
    let modified = |path: &PathBuf| fs::metadata(path).and_then(|of| of.modified()).ok();
    found
        .max_by_key(modified)
        .expect("`libm` is a dependency of the tests")
}

pub fn succeed(command: &mut Command) {
    let output = command
        .output()
        .unwrap_or_else(|error| panic!("{command:?} does not start: {error}"));
    let messages: String = String::from_utf8_lossy(&output.stderr)
        .chars()
        .take(4000)
        .collect();
    assert!(output.status.success(), "{command:?}:\n{messages}");
}

/// Names of a folder's files with their contents, for comparing two emissions.
pub fn contents(folder: &Path) -> Vec<(PathBuf, String)> {
    let mut files = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(next) = folders.pop() {
        for entry in fs::read_dir(next).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                folders.push(path);
            } else {
                let text = fs::read_to_string(&path).expect("text");
                files.push((path.strip_prefix(folder).expect("below").to_owned(), text));
            }
        }
    }
    files.sort();
    files
}
