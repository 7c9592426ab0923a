//! Equations and code of a model.

use std::path::PathBuf;

use pyo3::prelude::*;
use romc::Error;
use romc::artifact;
use romc::cli::UnitsChoice;
use romc::deploy::{self, EmitOptions, Target};
use romc::equations::Equations;
use romc::files::{EmittedFile, Overwrite};
use romc::limits::table;
use romc::model::CandidateTerm;
use romc::typeset::latex::tex_cases;
use romc::typeset::words;
use romc::typeset::{
    Decimal, NumberStyle, PrintOptions, Rounding, SymbolTable, TextOptions, Typeset,
};

use crate::errors::{choice, count_within, python_error, within};
use crate::model::Model;

/// Width of the lines of a notebook, in em.
const NOTEBOOK_EM: f64 = 60.0;

/// The options of `romc compile`, under the same names.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct EmitArguments {
    digits: Option<usize>,
    significant: Option<usize>,
    /// Whether coefficients are printed in full where no digits are set.
    exact: bool,
    width: Option<f64>,
    form: Option<String>,
    siunitx: bool,
    as_learned: bool,
    /// `VARIABLE=NAME` each.
    rename: Vec<String>,
    precision: String,
    /// Physical where the model has physical units, if not given.
    units: Option<String>,
    sincos: String,
}

/// The same for the library.
struct Emission {
    as_learned: bool,
    is_physical: bool,
    options: EmitOptions,
}

impl EmitArguments {
    fn emission(&self, model: &Model, py: Python<'_>) -> PyResult<Emission> {
        let units = match &self.units {
            Some(units) => choice(py, "units", units)?,
            None => match Equations::of(&model.data).in_physical_units() {
                Ok(_) => UnitsChoice::Physical,
                Err(_) => UnitsChoice::Si,
            },
        };
        let symbols = SymbolTable::parse(&self.rename, model.data.latent_dim());
        let symbols = symbols.map_err(|error| python_error(py, error))?;
        let form = self.form.as_deref().map(|name| choice(py, "form", name));
        let count = |range, digits: Option<usize>| {
            digits
                .map(|digits| count_within(py, range, digits))
                .transpose()
        };
        let digits = count(table::DIGITS, self.digits)?;
        let significant = count(table::SIGNIFICANT, self.significant)?;
        let width = self.width.map(|width| within(py, table::WIDTH, width));
        let print = PrintOptions {
            rounding: match (digits, significant) {
                (Some(places), _) => Rounding::Decimals(places),
                (None, Some(digits)) => Rounding::Significant(digits),
                (None, None) if self.exact => Rounding::Exact,
                (None, None) => units.usual_rounding(),
            },
            width_em: width.transpose()?,
            symbols,
            digest: Some(artifact::digest(&model.data).short()),
            numbers: match self.siunitx {
                true => NumberStyle::Siunitx,
                false => NumberStyle::Plain,
            },
            form: form.transpose()?.unwrap_or_default(),
        };
        Ok(Emission {
            as_learned: self.as_learned,
            is_physical: units == UnitsChoice::Physical,
            options: EmitOptions {
                precision: choice(py, "precision", &self.precision)?,
                sines: choice(py, "sincos", &self.sincos)?,
                units: units.of_interface(),
                print,
                ..EmitOptions::default()
            },
        })
    }
}

impl Emission {
    fn equations<'m>(&self, model: &'m Model) -> Result<Equations<'m>, Error> {
        let equations = match self.as_learned {
            true => Equations::as_learned(&model.data),
            false => Equations::of(&model.data),
        };
        match self.is_physical {
            true => Ok(equations.in_physical_units()?),
            false => Ok(equations),
        }
    }
}

/// The equations of a phase.
#[derive(IntoPyObject)]
pub struct PhaseText {
    name: String,
    /// When it holds, in words.
    feet: String,
    /// A `cases` environment.
    latex: String,
    /// Coefficient, its digits in print and term of each summand of each acceleration.
    terms: Vec<Vec<(f64, String, String)>>,
}

/// Path and text of each file of the targets.
#[pyfunction]
pub fn emit(
    py: Python<'_>,
    model: &Model,
    targets: Vec<String>,
    arguments: EmitArguments,
) -> PyResult<Vec<(String, String)>> {
    let targets = targets.iter().map(|name| choice(py, "targets", name));
    let targets: Vec<Target> = targets.collect::<PyResult<_>>()?;
    let emission = arguments.emission(model, py)?;
    let files = py.detach(|| -> Result<Vec<EmittedFile>, Error> {
        let equations = emission.equations(model)?;
        Ok(deploy::emit(&equations, &targets, &emission.options)?)
    });
    let files = files.map_err(|error| python_error(py, error))?.into_iter();
    Ok(files.map(|file| (file.path, file.contents)).collect())
}

/// The equations of each phase, and their rounding in words.
#[pyfunction]
pub fn equations(
    py: Python<'_>,
    model: &Model,
    arguments: EmitArguments,
) -> PyResult<(Vec<PhaseText>, String)> {
    let emission = arguments.emission(model, py)?;
    let made = py.detach(|| -> Result<_, Error> {
        let equations = emission.equations(model)?;
        let print = &emission.options.print;
        let typeset = Typeset::new(&equations, &print.symbols, print.rounding);
        // Text is read back: it has all digits where none are set.
        let in_text = match print.rounding {
            Rounding::Adaptive => Rounding::Exact,
            rounding => rounding,
        };
        let width_em = print.width_em.unwrap_or(NOTEBOOK_EM);
        let phases = typeset.systems.iter().zip(&equations.phases);
        let phases = phases
            .zip(model.data.phases())
            .map(|((system, phase), rule)| {
                let summands = |output| {
                    let summands = phase.summands(&equations, output);
                    let summand = |(xi, term): (f64, &CandidateTerm)| {
                        let digits = Decimal::rounded(xi, in_text).to_string();
                        (xi, digits, term.text.clone())
                    };
                    summands.map(summand).collect()
                };
                PhaseText {
                    name: phase.name.clone(),
                    feet: words::feet(&rule.feet),
                    latex: tex_cases(system, width_em),
                    terms: (0..equations.latent_dim()).map(summands).collect(),
                }
            });
        let rounding = words::rounding(&words::PLAIN, print.rounding, &typeset.rounding);
        Ok((phases.collect(), rounding))
    });
    made.map_err(|error| python_error(py, error))
}

/// The equations as text of at most 80 columns, with the quantities of the latent coordinates.
#[pyfunction]
pub fn equations_text(py: Python<'_>, model: &Model, arguments: EmitArguments) -> PyResult<String> {
    let emission = arguments.emission(model, py)?;
    let text = py.detach(|| -> Result<_, Error> {
        let equations = emission.equations(model)?;
        let print = &emission.options.print;
        let options = TextOptions {
            rounding: Some(print.rounding),
            symbols: print.symbols.clone(),
            columns: None,
        };
        Ok(romc::typeset::equations_text(&equations, &options))
    });
    text.map_err(|error| python_error(py, error))
}

/// Writes files into a folder, all or none; returns their paths.
#[pyfunction]
pub fn write_files(
    py: Python<'_>,
    folder: PathBuf,
    files: Vec<(String, String)>,
    force: bool,
) -> PyResult<Vec<PathBuf>> {
    let files = files.into_iter();
    let files: Vec<_> = files
        .map(|(path, text)| EmittedFile::new(path, text))
        .collect();
    let overwrite = Overwrite::from(force);
    let written = py.detach(|| romc::files::write_files(&folder, &files, overwrite));
    written.map_err(|error| python_error(py, error))
}
