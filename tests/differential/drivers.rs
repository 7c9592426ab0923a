//! Compiles generated code of many models into one program and runs it on many points;
//! numbers pass as their bits through files.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use romc::backend::{EmitOptions, Precision, Target, emit, write_files};
use romc::files::Overwrite;
use romc::lower::LowerOptions;
use romc::model::ReducedModel;

use super::functions::Function;

/// A folder with the generated code of some models.
pub struct Workshop {
    folder: tempfile::TempDir,
    models: Vec<String>,
    precision: Precision,
}

impl Workshop {
    pub fn new(models: &[ReducedModel], lower: &LowerOptions) -> Self {
        Self::in_precision(models, lower, Precision::Double)
    }

    pub fn in_precision(
        models: &[ReducedModel],
        lower: &LowerOptions,
        precision: Precision,
    ) -> Self {
        let options = EmitOptions {
            lower: *lower,
            precision,
            ..EmitOptions::default()
        };
        let folder = tempfile::tempdir().expect("a temporary folder");
        for model in models {
            let files = emit(model, &[Target::C, Target::Rust], &options);
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

    /// Runs the functions as C compiled by `compiler` with `flags`.
    pub fn run_c(
        &self,
        compiler: &str,
        flags: &[&str],
        functions: &[Function],
        points: &[Vec<f64>],
    ) -> Vec<Vec<f64>> {
        let driver = self.path().join("driver.c");
        let text = c_driver(&self.models, functions);
        let text = match self.precision {
            Precision::Double => text,
            Precision::Single => text.replace("double", "float"),
        };
        fs::write(&driver, text).expect("written");
        let program = self.path().join("driver_c");
        let sources = self
            .models
            .iter()
            .map(|model| self.path().join(model).join(format!("{model}.c")));
        succeed(
            Command::new(compiler)
                .args(["-std=c99", "-Wall", "-Wextra", "-Wconversion", "-Wshadow"])
                .args(["-pedantic", "-Werror"])
                .args(flags)
                .arg("-I")
                .arg(self.path())
                .arg(driver)
                .args(sources)
                .arg("-o")
                .arg(&program)
                .arg("-lm"),
        );
        self.run(&program, functions, points)
    }

    /// Runs the functions as Rust; each crate becomes a module of one program.
    pub fn run_rust(&self, functions: &[Function], points: &[Vec<f64>]) -> Vec<Vec<f64>> {
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
        let driver = self.path().join("driver.rs");
        fs::write(&driver, source).expect("written");
        let program = self.path().join("driver_rust");
        let rustc = std::env::var("RUSTC").unwrap_or_else(|_| "rustc".to_owned());
        succeed(
            Command::new(rustc)
                .args([
                    "--edition",
                    "2021",
                    "-C",
                    "opt-level=1",
                    "--cfg",
                    "feature=\"std\"",
                ])
                .args([
                    "--check-cfg",
                    "cfg(feature, values(\"std\", \"libm\"))",
                    "--check-cfg",
                    "cfg(test)",
                ])
                .arg(driver)
                .arg("-o")
                .arg(&program),
        );
        self.run(&program, functions, points)
    }

    /// Compiles and runs the C self-test of a model, which also compares batches.
    pub fn run_c_selftest(&self, compiler: &str, model: &str) {
        let folder = self.path().join(model);
        let program = folder.join("selftest");
        succeed(
            Command::new(compiler)
                .args([
                    "-std=c99",
                    "-O2",
                    "-Wall",
                    "-Wextra",
                    "-Wconversion",
                    "-Wshadow",
                ])
                .args(["-pedantic", "-Werror"])
                .args([
                    folder.join(format!("{model}.c")),
                    folder.join(format!("{model}_selftest.c")),
                ])
                .arg("-o")
                .arg(&program)
                .arg("-lm"),
        );
        succeed(&mut Command::new(program));
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

    fn run(&self, program: &Path, functions: &[Function], points: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let (inputs, outputs) = (self.path().join("inputs"), self.path().join("outputs"));
        let bytes: Vec<u8> = points
            .iter()
            .flatten()
            .flat_map(|&x| match self.precision {
                Precision::Double => x.to_ne_bytes().to_vec(),
                Precision::Single => (x as f32).to_ne_bytes().to_vec(),
            })
            .collect();
        fs::write(&inputs, bytes).expect("written");
        succeed(Command::new(program).arg(&inputs).arg(&outputs));
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

/// The C compilers to try: `CC` or `cc`, and clang where it is installed.
pub fn c_compilers() -> Vec<String> {
    let mut compilers = vec![std::env::var("CC").unwrap_or_else(|_| "cc".to_owned())];
    if Command::new("clang").arg("--version").output().is_ok() {
        compilers.push("clang".to_owned());
    }
    compilers
}

fn succeed(command: &mut Command) {
    let output = command
        .output()
        .unwrap_or_else(|error| panic!("{command:?} does not start: {error}"));
    let messages: String = String::from_utf8_lossy(&output.stderr)
        .chars()
        .take(4000)
        .collect();
    assert!(output.status.success(), "{command:?}:\n{messages}");
}

/// Where each slot begins in a function's flat record of inputs or outputs.
fn offsets(slots: &[romc::ir::Slot]) -> Vec<(&str, usize, usize)> {
    let mut offset = 0;
    slots
        .iter()
        .map(|slot| {
            let at = offset;
            offset += slot.len;
            (slot.name.as_str(), at, slot.len)
        })
        .collect()
}

fn c_driver(models: &[String], functions: &[Function]) -> String {
    let mut text = String::from("#include <stdio.h>\n#include <stdlib.h>\n#include <string.h>\n");
    for model in models {
        text.push_str(&format!("#include \"{model}/{model}.h\"\n"));
    }
    let mut calls = String::new();
    for (k, function) in functions.iter().enumerate() {
        let (model, name) = (&function.model, &function.name);
        let mut body = String::new();
        let mut arguments = Vec::new();
        let outputs = offsets(function.program.outputs());
        for (slot, at, len) in offsets(function.program.inputs()) {
            let in_place = outputs.iter().find(|(name, ..)| *name == slot);
            if let Some((_, to, _)) = in_place {
                body.push_str(&format!(
                    "memcpy(out + {to}, in + {at}, {len} * sizeof *in);\n"
                ));
                arguments.push(format!("out + {to}"));
            } else if slot == "h" {
                arguments.push(format!("in[{at}]"));
            } else {
                arguments.push(format!("in + {at}"));
            }
        }
        if !function.is_step() {
            arguments.extend(outputs.iter().map(|(_, at, _)| format!("out + {at}")));
        }
        if name.ends_with("_jacobian") && outputs.len() == 1 {
            arguments.push("out".to_owned());
        }
        let arguments = arguments.join(", ");
        text.push_str(&format!(
            "static void run{k}(const double *in, double *out) {{\n{body}{model}_{name}({arguments});\n}}\n"
        ));
        let (n, from, to) = (
            function.n_points,
            function.input_len(),
            function.output_len(),
        );
        calls.push_str(&format!(
            "for (size_t p = 0; p < {n}; ++p, in += {from}, out += {to}) run{k}(in, out);\n"
        ));
    }
    let total = |len: fn(&Function) -> usize| -> usize {
        functions.iter().map(|f| f.n_points * len(f)).sum()
    };
    let (from, to) = (total(Function::input_len), total(Function::output_len));
    text.push_str(&format!(
        "int main(int argc, char **argv) {{
double *inputs = malloc({from} * sizeof *inputs), *outputs = malloc({to} * sizeof *outputs);
if (argc != 3 || !inputs || !outputs) return 2;
const double *in = inputs;
double *out = outputs;
FILE *file = fopen(argv[1], \"rb\");
if (!file || fread(inputs, sizeof *inputs, {from}, file) != {from}) return 3;
fclose(file);
{calls}file = fopen(argv[2], \"wb\");
if (!file || fwrite(outputs, sizeof *outputs, {to}, file) != {to}) return 4;
return fclose(file) == 0 ? 0 : 5;
}}\n"
    ));
    text
}

fn rust_driver(functions: &[Function]) -> String {
    let mut text = String::from(
        "fn array<const N: usize>(values: &[f64]) -> &[f64; N] { values.try_into().unwrap() }
fn array_mut<const N: usize>(values: &mut [f64]) -> &mut [f64; N] { values.try_into().unwrap() }
fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let bytes = std::fs::read(&arguments[1]).unwrap();
    let mut numbers = bytes.chunks_exact(8).map(|b| f64::from_ne_bytes(b.try_into().unwrap()));
    let mut results: Vec<f64> = Vec::new();
",
    );
    for (k, function) in functions.iter().enumerate() {
        let (n, from, to) = (
            function.n_points,
            function.input_len(),
            function.output_len(),
        );
        text.push_str(&format!(
            "    let mut input = [0.0; {from}];\n    let mut output = [0.0; {to}];\n    \
             for _ in 0..{n} {{\n        for x in &mut input {{ *x = numbers.next().unwrap(); }}\n        \
             run{k}(&input, &mut output);\n        results.extend(output);\n    }}\n"
        ));
    }
    text.push_str(
        "    let bytes: Vec<u8> = results.iter().flat_map(|x| x.to_ne_bytes()).collect();
    std::fs::write(&arguments[2], bytes).unwrap();\n}\n",
    );
    for (k, function) in functions.iter().enumerate() {
        let mut body = String::new();
        let mut arguments = Vec::new();
        let outputs = offsets(function.program.outputs());
        let mut rest = "out".to_owned();
        for (j, (name, at, len)) in outputs.iter().enumerate() {
            body.push_str(&format!(
                "    let (o{j}, rest{j}) = {rest}.split_at_mut({len});\n    let _ = {at};\n"
            ));
            rest = format!("rest{j}");
            for (input, from, _) in offsets(function.program.inputs()) {
                if input == *name {
                    body.push_str(&format!(
                        "    o{j}.copy_from_slice(&input[{from}..{}]);\n",
                        from + len
                    ));
                }
            }
        }
        body.push_str(&format!("    let _ = {rest};\n"));
        for (name, at, len) in offsets(function.program.inputs()) {
            let in_place = outputs.iter().position(|(output, ..)| *output == name);
            arguments.push(match in_place {
                Some(j) => format!("array_mut(o{j})"),
                None if name == "h" => format!("input[{at}]"),
                None => format!("array(&input[{at}..{}])", at + len),
            });
        }
        if !function.is_step() {
            arguments.extend((0..outputs.len()).map(|j| format!("array_mut(o{j})")));
        }
        if function.name.ends_with("_jacobian") && outputs.len() == 1 {
            arguments.push("&mut []".to_owned());
        }
        text.push_str(&format!(
            "fn run{k}(input: &[f64], out: &mut [f64]) {{\n{body}    {}::{}({});\n}}\n",
            function.model,
            function.name,
            arguments.join(", ")
        ));
    }
    text
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
