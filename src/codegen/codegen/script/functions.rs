//! Functions that return what they compute, as text for the templates.

use crate::codegen::code::{Function, Parameter, Role};
use crate::codegen::line_wrapping::comment_lines;
use crate::codegen::tables::Tables;

/// A function of a script. A parameter that is read and written is taken and returned.
pub(crate) struct FunctionText {
    parameters: Vec<Parameter>,
    pub name: String,
    /// Lines of documentation, not yet escaped.
    pub docs: Vec<String>,
    pub body: String,
    /// Whether values that are not numbers are computed and not selected.
    pub selects: bool,
    /// Tables that the statements read, by name.
    pub tables: Vec<String>,
}

impl FunctionText {
    pub(crate) fn new(function: Function, tables: &Tables) -> Self {
        let body = function.body;
        let names = tables.known.iter().map(|(name, _)| name.to_string());
        let is_read = |name: &String| {
            body.contains(&format!("{name}[")) || body.contains(&format!("{name}("))
        };
        Self {
            parameters: function.parameters,
            name: function.name.to_string(),
            docs: comment_lines(&function.docs, 90),
            tables: names.filter(is_read).collect(),
            selects: body.contains("np.where("),
            body,
        }
    }

    fn of(&self, roles: &[Role]) -> Vec<&Parameter> {
        let parameters = self.parameters.iter();
        parameters.filter(|p| roles.contains(&p.role)).collect()
    }

    pub(crate) fn inputs(&self) -> Vec<&Parameter> {
        self.of(&[Role::Input, Role::InOut, Role::Scalar])
    }

    pub(crate) fn outputs(&self) -> Vec<&Parameter> {
        self.of(&[Role::Output, Role::InOut])
    }

    pub(crate) fn arrays(&self) -> Vec<&Parameter> {
        self.of(&[Role::Input, Role::InOut])
    }

    /// What is taken and returned.
    pub(crate) fn copied(&self) -> Vec<&Parameter> {
        self.of(&[Role::InOut])
    }

    /// What is returned and not taken, so that the body has to begin with it.
    pub(crate) fn created(&self) -> Vec<&Parameter> {
        self.of(&[Role::Output])
    }
}

pub(crate) fn list<T>(elements: &[T], print: impl Fn(&T) -> String) -> String {
    elements.iter().map(print).collect::<Vec<_>>().join(", ")
}

pub(crate) fn names(parameters: Vec<&Parameter>) -> String {
    list(&parameters, |parameter| parameter.name.to_string())
}
