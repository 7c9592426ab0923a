//! Arrays and functions of generated code, before a dialect spells them.

use super::ident::Ident;

/// A subscript `offset + sum_i stride_i * name_i`.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Index {
    /// Strides and the variables that they multiply.
    pub terms: Vec<(usize, Ident)>,
    pub offset: usize,
}

impl Index {
    pub(crate) fn fixed(offset: usize) -> Self {
        Self {
            terms: Vec::new(),
            offset,
        }
    }

    pub(crate) fn variable(name: &Ident) -> Self {
        Self::fixed(0).plus(1, name)
    }

    pub(crate) fn plus(mut self, stride: usize, name: &Ident) -> Self {
        self.terms.push((stride, name.clone()));
        self
    }

    pub(crate) fn shifted(mut self, by: usize) -> Self {
        self.offset += by;
        self
    }
}

/// `len` elements of an array from `offset` on, handed to a function.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Span {
    pub array: Ident,
    pub offset: usize,
    pub len: usize,
    pub of: usize,
    /// Whether the array is a parameter of the function rather than a local array.
    pub is_parameter: bool,
}

impl Span {
    pub(crate) fn whole(array: &Ident, len: usize, is_parameter: bool) -> Self {
        Self {
            array: array.clone(),
            offset: 0,
            len,
            of: len,
            is_parameter,
        }
    }

    pub(crate) fn is_whole(&self) -> bool {
        self.offset == 0 && self.len == self.of
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    Input,
    Output,
    InOut,
    Scalar,
}

/// A parameter of a generated function, in a language or, with a text for a name, in any.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter<N = Ident> {
    pub name: N,
    /// Number of elements; an output may have none.
    pub len: usize,
    pub role: Role,
}

pub struct Function {
    pub name: Ident,
    pub docs: Vec<String>,
    pub parameters: Vec<Parameter>,
    /// Parameters that the body does not mention.
    pub unused: Vec<Ident>,
    pub body: String,
}

/// Where parameters become results, as in scripts: one that is read and written is an argument and returned.
impl Function {
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

    pub(crate) fn copied(&self) -> Vec<&Parameter> {
        self.of(&[Role::InOut])
    }

    /// What is returned and no argument, so that the body has to begin with it.
    pub(crate) fn created(&self) -> Vec<&Parameter> {
        self.of(&[Role::Output])
    }

    /// Whether a statement mentions a table or a function.
    pub(crate) fn mentions(&self, name: &str) -> bool {
        self.body.contains(&format!("{name}[")) || self.body.contains(&format!("{name}("))
    }
}
