//! Types of the subset, and how C declares them.

/// A type; lengths of arrays are C expressions.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Type {
    Unit,
    Real,
    Double,
    Int,
    Bool,
    /// A struct or enum, by its name in Rust.
    Named(String),
    Array(Box<Type>, String),
    Slice(Box<Type>),
    Ref(Box<Type>, bool),
}

impl Type {
    pub(crate) fn reference(self, is_mutable: bool) -> Self {
        Self::Ref(Box::new(self), is_mutable)
    }

    /// The type that a reference refers to, or the type itself.
    pub(crate) fn referent(&self) -> &Self {
        match self {
            Self::Ref(of, _) => of,
            other => other,
        }
    }

    pub(crate) fn element(&self) -> Option<&Self> {
        match self.referent() {
            Self::Array(of, _) | Self::Slice(of) => Some(of),
            _ => None,
        }
    }

    pub(crate) fn with_lengths(&self, change: &mut dyn FnMut(&str) -> String) -> Self {
        match self {
            Self::Array(of, length) => {
                Self::Array(Box::new(of.with_lengths(change)), change(length))
            }
            Self::Slice(of) => Self::Slice(Box::new(of.with_lengths(change))),
            Self::Ref(of, is_mutable) => of.with_lengths(change).reference(*is_mutable),
            other => other.clone(),
        }
    }

    pub(crate) fn is_number(&self) -> bool {
        matches!(self, Self::Real | Self::Double | Self::Int)
    }

    /// Whether a variable of this type is declared `const` unless it changes.
    pub(crate) fn is_scalar(&self) -> bool {
        self.is_number() || *self == Self::Bool
    }

    /// The structs and enums that a value holds or points to.
    pub(crate) fn named(&self) -> Option<&str> {
        match self {
            Self::Named(name) => Some(name),
            Self::Array(of, _) | Self::Slice(of) | Self::Ref(of, _) => of.named(),
            _ => None,
        }
    }

    /// C's declaration of a name with this type; `spelling` spells structs and enums.
    pub(crate) fn declare(&self, name: &str, spelling: &dyn Fn(&str) -> String) -> String {
        match self {
            Self::Unit => format!("void {name}"),
            Self::Real => format!("real {name}"),
            Self::Double => format!("double {name}"),
            Self::Int => format!("int {name}"),
            Self::Bool => format!("bool {name}"),
            Self::Named(of) => format!("{} {name}", spelling(of)),
            Self::Array(of, length) => of.declare(&format!("{name}[{length}]"), spelling),
            Self::Slice(of) => of.declare(name, spelling),
            Self::Ref(of, is_mutable) => match of.as_ref() {
                Self::Array(element, _) | Self::Slice(element) => {
                    pointer(element, *is_mutable, name, spelling)
                }
                other => other.declare(&format!("*{name}"), spelling),
            },
        }
    }

    /// C's declaration of a parameter; arrays keep their length, but for constant vectors.
    pub(crate) fn parameter(
        &self,
        name: &str,
        restrict: bool,
        spelling: &dyn Fn(&str) -> String,
    ) -> String {
        let Self::Ref(of, is_mutable) = self else {
            return self.declare(name, spelling);
        };
        let is_restrict = restrict && *is_mutable;
        let restrict = if is_restrict { "restrict " } else { "" };
        match of.as_ref() {
            Self::Array(element, length) if *is_mutable || element.element().is_some() => {
                element.declare(&format!("{name}[{restrict}{length}]"), spelling)
            }
            Self::Array(element, _) => pointer(element, false, name, spelling),
            Self::Slice(element) => {
                pointer(element, *is_mutable, &format!("{restrict}{name}"), spelling)
            }
            other => other.declare(&format!("*{restrict}{name}"), spelling),
        }
    }
}

/// A pointer to elements: numbers are `const` unless they change; C99 converts no pointer to one to constant arrays.
fn pointer(
    element: &Type,
    is_mutable: bool,
    name: &str,
    spelling: &dyn Fn(&str) -> String,
) -> String {
    if element.element().is_some() {
        return element.declare(&format!("(*{name})"), spelling);
    }
    let pointer = element.declare(&format!("*{name}"), spelling);
    match !is_mutable && element.is_number() {
        true => format!("const {pointer}"),
        false => pointer,
    }
}
