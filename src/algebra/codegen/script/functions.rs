//! Functions that return what they compute, as text for the templates.

use std::collections::BTreeSet;

use crate::codegen::code::{Function, Role};
use crate::codegen::error::CodegenError;
use crate::codegen::functions::ModelFunctions;
use crate::codegen::interface::{ModelInterface, PhaseInterface};
use crate::codegen::line_wrapping::comment_lines;
use crate::codegen::phase_text::PhaseText;
use crate::codegen::printer::Printer;

/// A function of a script.
pub struct FunctionText {
    /// Its name.
    pub name: String,
    /// Lines of documentation, not yet escaped.
    pub docs: Vec<String>,
    /// Parameters that it takes.
    pub inputs: Vec<ArrayText>,
    /// What it returns.
    pub outputs: Vec<ArrayText>,
    /// Its statements.
    pub body: String,
    /// Tables that the statements read, by name.
    pub tables: Vec<String>,
}

impl FunctionText {
    /// The names of its parameters.
    pub fn parameters(&self) -> String {
        list(&self.inputs, |input| input.name.clone())
    }

    /// The names of its results.
    pub fn results(&self) -> String {
        list(&self.outputs, |output| output.name.clone())
    }

    /// The parameters that are arrays, with their lengths.
    pub fn arrays(&self) -> Vec<(&str, usize)> {
        let arrays = self.inputs.iter().filter(|input| !input.is_scalar);
        arrays.map(ArrayText::pair).collect()
    }

    /// What is returned and not taken, so that the body has to begin with it.
    pub fn created(&self) -> Vec<(&str, usize)> {
        let results = self.outputs.iter().filter(|array| !self.takes(array));
        results.map(ArrayText::pair).collect()
    }

    /// What is taken and returned.
    pub fn copied(&self) -> Vec<&str> {
        let results = self.outputs.iter().filter(|array| self.takes(array));
        results.map(|array| array.name.as_str()).collect()
    }

    fn takes(&self, array: &ArrayText) -> bool {
        self.inputs.iter().any(|input| input.name == array.name)
    }
}

/// A parameter or result.
pub struct ArrayText {
    /// Its name.
    pub name: String,
    /// Number of rows.
    pub len: usize,
    /// Whether it is one number.
    pub is_scalar: bool,
}

impl ArrayText {
    fn pair(&self) -> (&str, usize) {
        (&self.name, self.len)
    }
}

/// Joins what is printed of each element.
pub fn list<T>(elements: &[T], print: impl Fn(&T) -> String) -> String {
    elements.iter().map(print).collect::<Vec<_>>().join(", ")
}

/// Prints a function, with the phase it belongs to, if it belongs to one.
pub type PrintFunction<'a, F> =
    dyn Fn(&FunctionText, Option<&PhaseInterface>) -> Result<F, CodegenError> + 'a;

/// A language's way to print functions and numbers.
pub struct Script<'a, F> {
    /// Prints statements.
    pub printer: Printer<'a>,
    /// Prints a function.
    pub print: &'a PrintFunction<'a, F>,
    /// Prints rows or columns of nonzeros, counted from 0.
    pub numbers: fn(&[usize]) -> String,
}

/// What the files of all languages say of a model; `F` is what they print of a function.
pub struct ModelText<F> {
    /// Name of the model.
    pub name: String,
    /// Name of the first phase's accelerations, for an example of a call.
    pub example: String,
    /// Units of robot coordinates.
    pub units: String,
    /// Number of latent coordinates.
    pub latent_dim: usize,
    /// Number of robot coordinates.
    pub state_dim: Option<usize>,
    /// Constant tables.
    pub tables: Vec<String>,
    /// Maps between robot and latent coordinates.
    pub maps: Vec<F>,
    /// Phases.
    pub phases: Vec<PhaseText<F>>,
}

impl<F> Script<'_, F> {
    /// All of a model.
    pub fn model(
        &self,
        entries: &ModelInterface,
        functions: &ModelFunctions,
    ) -> Result<ModelText<F>, CodegenError> {
        let print = |function: &Function, phase: Option<&PhaseInterface>| {
            (self.print)(&text(function, functions, &self.printer), phase)
        };
        let phase = |(phase, of_phase): (&PhaseInterface, &[Function; 3])| {
            let texts = of_phase.iter().map(|function| print(function, Some(phase)));
            let texts = texts.collect::<Result<_, CodegenError>>()?;
            Ok(PhaseText::new(phase, texts, self.numbers))
        };
        let maps = functions.maps.iter().map(|map| print(map, None));
        let phases = entries.phases.iter().zip(&functions.phases).map(phase);
        let first = entries.phases.first();
        let texts = functions
            .all()
            .map(|function| text(function, functions, &self.printer));
        let read: BTreeSet<String> = texts.flat_map(|text| text.tables).collect();
        Ok(ModelText {
            name: entries.name.clone(),
            example: first.map_or(String::new(), |phase| phase.dynamics.name.clone()),
            units: entries.units_in_words(),
            latent_dim: entries.latent_dim,
            state_dim: entries.state_dim,
            tables: functions
                .tables
                .iter()
                .filter(|table| read.contains(&table.name.to_string()))
                .map(|table| self.printer.table(table))
                .collect(),
            maps: maps.collect::<Result<_, CodegenError>>()?,
            phases: phases.collect::<Result<_, CodegenError>>()?,
        })
    }
}

fn text(function: &Function, functions: &ModelFunctions, printer: &Printer) -> FunctionText {
    let arrays = |wanted: fn(Role) -> bool| -> Vec<ArrayText> {
        let parameters = function.parameters.iter().filter(|p| wanted(p.role));
        parameters
            .map(|parameter| ArrayText {
                name: parameter.name.to_string(),
                len: parameter.len,
                is_scalar: parameter.role == Role::Scalar,
            })
            .collect()
    };
    let body = printer.statements(&function.body, 1);
    let names = functions.tables.iter().map(|table| table.name.to_string());
    let is_read =
        |name: &String| body.contains(&format!("{name}[")) || body.contains(&format!("{name}("));
    FunctionText {
        name: function.name.to_string(),
        docs: comment_lines(&function.docs, 90),
        inputs: arrays(|role| match role {
            Role::Input | Role::InOut | Role::Scalar => true,
            Role::Output => false,
        }),
        outputs: arrays(|role| match role {
            Role::Output | Role::InOut => true,
            Role::Input | Role::Scalar => false,
        }),
        tables: names.filter(is_read).collect(),
        body,
    }
}
