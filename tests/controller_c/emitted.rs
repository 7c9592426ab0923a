//! Generated folders of controllers in C, and programs built from them.

use std::fs;
use std::path::PathBuf;
use std::process::Command;

use romc::codegen::{Precision, SineCosine};
use romc::deploy::{EmitOptions, Target, emit};
use romc::equations::Equations;
use romc::model::ReducedModel;

use crate::programs::{root, succeed};

/// Warnings that the sources must not cause.
pub const STRICT: [&str; 10] = [
    "-std=c99",
    "-Wall",
    "-Wextra",
    "-Wconversion",
    "-Wshadow",
    "-pedantic",
    "-Wdouble-promotion",
    "-Wfloat-equal",
    "-Wvla",
    "-Werror",
];

/// A generated folder.
pub struct Emitted {
    pub name: String,
    pub scratch: tempfile::TempDir,
}

impl Emitted {
    pub fn new(model: &ReducedModel, precision: Precision) -> Self {
        Self::with(model, precision, SineCosine::default())
    }

    /// With the sines of the C library, which romc's library uses as well.
    pub fn with_library_sines(model: &ReducedModel) -> Self {
        Self::with(model, Precision::Double, SineCosine::Library)
    }

    fn with(model: &ReducedModel, precision: Precision, sines: SineCosine) -> Self {
        let options = EmitOptions {
            precision,
            sines,
            ..EmitOptions::default()
        };
        let files = emit(&Equations::of(model), &[Target::ControllerC], &options);
        let scratch = tempfile::tempdir().expect("a folder");
        for file in files.expect("a complete model") {
            let path = scratch.path().join(&file.path);
            fs::create_dir_all(path.parent().expect("inside the folder")).expect("a folder");
            fs::write(path, file.contents).expect("written");
        }
        let name = model.identifier().to_string();
        Self { name, scratch }
    }

    pub fn folder(&self) -> PathBuf {
        self.scratch
            .path()
            .join(format!("{}-controller-c", self.name))
    }

    /// Compiles a source of the folder, or another, unless it is compiled already; returns the object. With -O1, which
    /// compiles faster than -O2, unless the flags have another level.
    pub fn object(&self, compiler: &str, flags: &[&str], source: &str) -> PathBuf {
        let key: String = format!("{compiler} {flags:?} {source}")
            .chars()
            .filter(|letter| letter.is_ascii_alphanumeric())
            .collect();
        let object = self.scratch.path().join(format!("{key}.o"));
        if object.exists() {
            return object;
        }
        let name = &self.name;
        succeed(
            Command::new(compiler)
                .args(STRICT)
                .args(["-O1", "-ffp-contract=off"])
                .args(flags)
                .arg(format!("-DNAME={name}"))
                .arg(format!("-DUPPER={}", name.to_ascii_uppercase()))
                .arg(format!("-DHEADER=\"{name}_controller.h\""))
                .args(["-I.", "-c", source, "-o"])
                .arg(&object)
                .current_dir(self.folder()),
        );
        object
    }

    /// The controller's two objects.
    pub fn objects(&self, compiler: &str, flags: &[&str]) -> [PathBuf; 2] {
        ["_controller.c", ".c"]
            .map(|end| self.object(compiler, flags, &format!("{}{end}", self.name)))
    }

    /// A program of the folder, or the replay of the tests, linked with the controller.
    pub fn program(&self, compiler: &str, flags: &[&str], source: &str) -> PathBuf {
        let main = self.object(compiler, flags, source);
        let program = main.with_extension("program");
        succeed(
            Command::new(compiler)
                .args(flags)
                .arg(main)
                .args(self.objects(compiler, flags))
                .args(["-lm", "-o"])
                .arg(&program),
        );
        program
    }

    /// Output of a program of the tests that includes the controller's source and reads a file.
    pub fn with_source(&self, source: &str, bytes: &[u8]) -> String {
        let file = self.scratch.path().join("samples");
        fs::write(&file, bytes).expect("written");
        let program = self.scratch.path().join("with_source");
        succeed(
            Command::new("cc")
                .args(STRICT)
                .args(["-O1", "-ffp-contract=off", "-I."])
                .arg(format!("-DNAME={}", self.name))
                .arg(format!("-DSOURCE=\"{}_controller.c\"", self.name))
                .arg(root().join("tests/controller_c").join(source))
                .arg(format!("{}.c", self.name))
                .args(["-lm", "-o"])
                .arg(&program)
                .current_dir(self.folder()),
        );
        Self::output(Command::new(program).arg(file))
    }

    /// Text of a command's standard output.
    pub fn output(command: &mut Command) -> String {
        String::from_utf8_lossy(&succeed(command).stdout).into_owned()
    }
}
