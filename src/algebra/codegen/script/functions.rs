//! Functions that return what they compute, as text for the templates.

use std::collections::BTreeSet;

use crate::codegen::code::{Function, Parameter, Role};
use crate::codegen::dialect::Dialect;
use crate::codegen::error::CodegenError;
use crate::codegen::functions::ModelFunctions;
use crate::codegen::interface::{ModelInterface, PhaseInterface};
use crate::codegen::line_wrapping::comment_lines;
use crate::codegen::model_text::ModelText;
use crate::codegen::printer::Printer;

/// A function of a script. A parameter that is read and written is taken and returned.
pub struct FunctionText<'a> {
    function: &'a Function,
    /// Its name.
    pub name: String,
    /// Lines of documentation, not yet escaped.
    pub docs: Vec<String>,
    /// Its statements.
    pub body: String,
    /// Tables that the statements read, by name.
    pub tables: Vec<String>,
}

impl<'a> FunctionText<'a> {
    fn new(function: &'a Function, functions: &ModelFunctions, printer: &Printer) -> Self {
        let body = printer.statements(&function.body, 1);
        let names = functions.tables.iter().map(|table| table.name.to_string());
        let is_read = |name: &String| {
            body.contains(&format!("{name}[")) || body.contains(&format!("{name}("))
        };
        Self {
            function,
            name: function.name.to_string(),
            docs: comment_lines(&function.docs, 90),
            tables: names.filter(is_read).collect(),
            body,
        }
    }

    /// Parameters of these roles.
    fn of(&self, roles: &[Role]) -> Vec<&'a Parameter> {
        let parameters = self.function.parameters.iter();
        parameters.filter(|p| roles.contains(&p.role)).collect()
    }

    /// What it takes.
    pub fn inputs(&self) -> Vec<&'a Parameter> {
        self.of(&[Role::Input, Role::InOut, Role::Scalar])
    }

    /// What it returns.
    pub fn outputs(&self) -> Vec<&'a Parameter> {
        self.of(&[Role::Output, Role::InOut])
    }

    /// The parameters that are arrays.
    pub fn arrays(&self) -> Vec<&'a Parameter> {
        self.of(&[Role::Input, Role::InOut])
    }

    /// What is taken and returned.
    pub fn copied(&self) -> Vec<&'a Parameter> {
        self.of(&[Role::InOut])
    }

    /// What is returned and not taken, so that the body has to begin with it.
    pub fn created(&self) -> Vec<&'a Parameter> {
        self.of(&[Role::Output])
    }
}

/// Joins what is printed of each element.
pub fn list<T>(elements: &[T], print: impl Fn(&T) -> String) -> String {
    elements.iter().map(print).collect::<Vec<_>>().join(", ")
}

/// Names of parameters.
pub fn names(parameters: Vec<&Parameter>) -> String {
    list(&parameters, |parameter| parameter.name.to_string())
}

/// Prints a function, with the phase it belongs to, if it belongs to one.
pub type PrintFunction<'a, F> =
    dyn Fn(&FunctionText, Option<&PhaseInterface>) -> Result<F, CodegenError> + 'a;

/// All of a model in a language, which prints functions, and rows or columns of nonzeros, counted from 0.
pub fn model_text<'a, F>(
    entries: &'a ModelInterface,
    dialect: &dyn Dialect,
    print: &PrintFunction<'_, F>,
    numbers: fn(&[usize]) -> String,
) -> Result<ModelText<'a, F>, CodegenError> {
    let functions = &ModelFunctions::new(entries, dialect, "");
    let printer = &Printer::new(dialect);
    let text = |function| FunctionText::new(function, functions, printer);
    let read: BTreeSet<String> = functions.all().flat_map(|f| text(f).tables).collect();
    let tables = functions.tables.iter();
    let tables = tables.filter(|table| read.contains(&table.name.to_string()));
    let tables = tables.map(|table| dialect.table(table)).collect();
    let print = |function: &Function, phase: Option<&PhaseInterface>| {
        print(&FunctionText::new(function, functions, printer), phase)
    };
    ModelText::new(entries, functions, tables, &print, numbers)
}
