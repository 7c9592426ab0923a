//! Expressions, their types, and the functions that they call.

use syn::{BinOp, Lit, UnOp};

use super::*;

#[derive(Debug, Clone)]
pub(crate) struct Value {
    pub(crate) text: String,
    pub(crate) ty: Type,
    /// How tightly C binds it: 16 a name or call, 15 a sign, 13 a product, 12 a sum, 10 to 3 conditions.
    pub(crate) rank: u8,
    /// The element of `[element; N]`.
    pub(crate) repeated: Option<String>,
}

impl Value {
    pub(crate) fn new(text: impl Into<String>, ty: Type, rank: u8) -> Self {
        Self {
            text: text.into(),
            ty,
            rank,
            repeated: None,
        }
    }

    /// The text as an operand, in parentheses if it binds more loosely than this.
    pub(crate) fn at_least(&self, rank: u8) -> String {
        match self.rank < rank {
            true => format!("({})", self.text),
            false => self.text.clone(),
        }
    }

    fn is_literal(&self) -> bool {
        self.text.parse::<f64>().is_ok()
    }

    /// The same in the place of a real: a whole number for a literal that is one, else its nearest real.
    fn into_real(self) -> Self {
        if self.ty != Type::Double || !self.is_literal() {
            return self;
        }
        match self.text.strip_suffix(".0") {
            Some(whole) => Value::new(whole, Type::Real, self.rank),
            None => Value::new(format!("(real){}", self.text), Type::Real, 15),
        }
    }
}

/// A binary operator of C, its rank, and whether its result is a condition.
pub(crate) fn operator(op: &BinOp) -> Option<(&'static str, u8, bool)> {
    Some(match op {
        BinOp::Add(_) => ("+", 12, false),
        BinOp::Sub(_) => ("-", 12, false),
        BinOp::Mul(_) => ("*", 13, false),
        BinOp::Div(_) => ("/", 13, false),
        BinOp::Rem(_) => ("%", 13, false),
        BinOp::Lt(_) => ("<", 10, true),
        BinOp::Le(_) => ("<=", 10, true),
        BinOp::Gt(_) => (">", 10, true),
        BinOp::Ge(_) => (">=", 10, true),
        BinOp::Eq(_) => ("==", 9, true),
        BinOp::Ne(_) => ("!=", 9, true),
        BinOp::And(_) => ("&&", 5, true),
        BinOp::Or(_) => ("||", 4, true),
        BinOp::AddAssign(_) => ("+=", 2, false),
        BinOp::SubAssign(_) => ("-=", 2, false),
        BinOp::MulAssign(_) => ("*=", 2, false),
        BinOp::DivAssign(_) => ("/=", 2, false),
        _ => return None,
    })
}

fn number(literal: &Lit) -> Option<(String, Type)> {
    match literal {
        Lit::Int(number) => Some((number.base10_digits().to_owned(), Type::Int)),
        Lit::Float(number) => Some((number.base10_digits().to_owned(), Type::Double)),
        Lit::Bool(flag) => Some((flag.value.to_string(), Type::Bool)),
        _ => None,
    }
}

/// The value of a constant: a number, or numbers in sums, products, arrays of reals and structs.
pub(crate) fn constant(items: &Items<'_>, source: usize, value: &Expr) -> Found<String> {
    match value {
        Expr::Lit(literal) => match number(&literal.lit) {
            Some((text, _)) => Ok(text),
            None => Err(items.fault(source, value, "a constant that is no number")),
        },
        Expr::Struct(fields) => {
            let field = |field: &syn::FieldValue| {
                let syn::Member::Named(name) = &field.member else {
                    return Err(items.fault(source, field, "a field without name"));
                };
                let value = constant(items, source, &field.expr)?;
                Ok(format!(".{name} = {value}"))
            };
            let fields: Result<Vec<_>, _> = fields.fields.iter().map(field).collect();
            Ok(format!("{{{}}}", fields?.join(", ")))
        }
        Expr::Array(array) => {
            let element = |value| Ok(format!("(real){}", constant(items, source, value)?));
            let elements: Result<Vec<_>, _> = array.elems.iter().map(element).collect();
            Ok(format!("{{{}}}", elements?.join(", ")))
        }
        Expr::Binary(binary) if operator(&binary.op).is_some_and(|(_, rank, _)| rank > 11) => {
            let (sign, ..) = operator(&binary.op).expect("it is one");
            let sides = [&binary.left, &binary.right];
            let [left, right] = sides.map(|side| constant(items, source, side));
            Ok(format!("({} {sign} {})", left?, right?))
        }
        Expr::Path(path) => match path.path.get_ident().map(ToString::to_string) {
            Some(name) if items.constants.contains_key(&name) => {
                constant(items, source, &items.constants[&name].value)
            }
            _ => Err(items.fault(source, value, "a constant that is no number")),
        },
        other => Err(items.fault(source, other, "a constant that is no number")),
    }
}

impl Writer<'_> {
    pub(crate) fn value(&mut self, here: &mut Instance<'_>, expression: &Expr) -> Found {
        self.value_as(here, expression, None)
    }

    pub(crate) fn value_as(
        &mut self,
        here: &mut Instance<'_>,
        expression: &Expr,
        expected: Option<&Type>,
    ) -> Found {
        let value = self.value_of(here, expression, expected)?;
        Ok(match expected {
            Some(Type::Real) => value.into_real(),
            _ => value,
        })
    }

    fn value_of(
        &mut self,
        here: &mut Instance<'_>,
        expression: &Expr,
        expected: Option<&Type>,
    ) -> Found {
        match expression {
            Expr::Paren(inner) => self.value_as(here, &inner.expr, expected),
            Expr::Lit(literal) => match number(&literal.lit) {
                Some((text, ty)) => Ok(Value::new(text, ty, 16)),
                None => Err(self.outside(here, literal, "this literal")),
            },
            Expr::Path(path) => self.path(here, path),
            Expr::Field(field) => self.field(here, field),
            Expr::Index(index) => self.index(here, index),
            Expr::Unary(unary) => self.unary(here, unary),
            Expr::Binary(binary) => self.binary(here, binary),
            Expr::Reference(reference) => self.reference(here, reference, expected),
            Expr::Cast(cast) => {
                let (source, owner) = (here.function.source, here.owner);
                let ty = self.items.ty(source, &cast.ty, owner)?;
                let value = self.value(here, &cast.expr)?;
                let spelled = ty.declare("", &|of| self.spelling(of));
                let text = format!("({}){}", spelled.trim(), value.at_least(15));
                Ok(Value::new(text, ty, 15))
            }
            Expr::If(branch) => self.choice(here, branch, expected),
            Expr::Repeat(repeat) => self.repeat(here, repeat, expected),
            Expr::Array(array) => self.array(here, array, expected),
            Expr::Struct(literal) => self.struct_literal(here, literal),
            Expr::Call(call) => self.call(here, call, expected),
            Expr::MethodCall(call) => self.method(here, call),
            other => Err(self.outside(here, other, "this expression")),
        }
    }

    fn path(&mut self, here: &Instance<'_>, path: &syn::ExprPath) -> Found {
        let words: Vec<String> = (path.path.segments.iter())
            .map(|segment| segment.ident.to_string())
            .collect();
        let words: Vec<&str> = words.iter().map(String::as_str).collect();
        match words.as_slice() {
            ["T" | "Self", "ZERO"] => Ok(Value::new("0", Type::Real, 16)),
            ["T" | "Self", "ONE"] => Ok(Value::new("1", Type::Real, 16)),
            [of, variant] if self.items.enums.contains_key(*of) => {
                let ty = self.resolve(&Type::Named((*of).to_owned()), &BTreeMap::new());
                Ok(Value::new(self.items.constant_name(variant), ty, 16))
            }
            [name] => {
                if let Some(ty) = here.variable(name) {
                    return Ok(Value::new(*name, ty.clone(), 16));
                }
                if let Some(elsewhere) = self.items.unit.elsewhere(name) {
                    let constant = self.items.constants.get(*name);
                    let ty = constant.map_or(Type::Int, |constant| constant.ty.clone());
                    return Ok(Value::new(elsewhere, ty, 16));
                }
                if let Some(size) = here.sizes.get(*name) {
                    let rank = if size.contains(' ') { 3 } else { 16 };
                    return Ok(Value::new(size, Type::Int, rank));
                }
                if here.function.const_parameters.iter().any(|p| p == name)
                    || ["NX", "NU"].contains(name)
                {
                    return Ok(Value::new(*name, Type::Int, 16));
                }
                if self.items.constants.contains_key(*name) {
                    let ty = self.items.constants[*name].ty.clone();
                    return Ok(Value::new(self.constant(name), ty, 16));
                }
                Err(self.outside(here, path, "a name of something else"))
            }
            _ => Err(self.outside(here, path, "this path")),
        }
    }

    fn field(&mut self, here: &mut Instance<'_>, field: &syn::ExprField) -> Found {
        let base = self.value(here, &field.base)?;
        let (Type::Named(of), syn::Member::Named(name)) = (base.ty.referent(), &field.member)
        else {
            return Err(self.outside(here, field, "a field of a value that is not a struct"));
        };
        let name = name.to_string();
        let items = self.items;
        let Some(found) = items.fields(of).iter().find(|field| field.name == name) else {
            return Err(self.outside(here, field, "a field that the struct does not have"));
        };
        let ty = self.resolve(&found.ty, &BTreeMap::new());
        let is_pointer = matches!(base.ty, Type::Ref(..));
        let arrow = if is_pointer { "->" } else { "." };
        let text = format!("{}{arrow}{name}", base.at_least(16));
        Ok(Value::new(text, ty, 16))
    }

    /// An element, or for a range the rest of the array after its beginning.
    fn index(&mut self, here: &mut Instance<'_>, index: &syn::ExprIndex) -> Found {
        let base = self.value(here, &index.expr)?;
        let Some(element) = base.ty.element().cloned() else {
            return Err(self.outside(here, index, "an index of a value that is not an array"));
        };
        if let Expr::Range(range) = index.index.as_ref() {
            let slice = Type::Slice(Box::new(element));
            return Ok(match &range.start {
                None => Value { ty: slice, ..base },
                Some(start) => {
                    let start = self.value(here, start)?;
                    let text = format!("{} + {}", base.at_least(12), start.at_least(13));
                    Value::new(text, slice, 12)
                }
            });
        }
        let at = self.value(here, &index.index)?.text;
        let text = format!("{}[{at}]", base.at_least(16));
        Ok(Value::new(text, element, 16))
    }

    fn unary(&mut self, here: &mut Instance<'_>, unary: &syn::ExprUnary) -> Found {
        let value = self.value(here, &unary.expr)?;
        let is_negative = value.text.starts_with('-');
        let (sign, ty) = match (unary.op, value.ty.referent()) {
            (UnOp::Neg(_), _) => ("-", value.ty.clone()),
            (UnOp::Not(_), _) => ("!", Type::Bool),
            (UnOp::Deref(_), ty @ Type::Array(..)) => {
                let ty = ty.clone();
                return Ok(Value { ty, ..value });
            }
            (UnOp::Deref(_), ty) => ("*", ty.clone()),
            _ => return Err(self.outside(here, unary, "this operator")),
        };
        let operand = value.at_least(if is_negative { 16 } else { 15 });
        Ok(Value::new(format!("{sign}{operand}"), ty, 15))
    }

    fn binary(&mut self, here: &mut Instance<'_>, binary: &syn::ExprBinary) -> Found {
        let mut left = self.value(here, &binary.left)?;
        let mut right = self.value(here, &binary.right)?;
        if left.ty == Type::Real {
            right = right.into_real();
        } else if right.ty == Type::Real {
            left = left.into_real();
        }
        let Some((sign, rank, is_condition)) = operator(&binary.op) else {
            return Err(self.outside(here, binary, "this operator"));
        };
        if !left.ty.is_scalar() && !matches!(left.ty, Type::Named(_)) {
            return Err(self.outside(here, binary, "an operator on a value that is not a number"));
        }
        let ty = match (is_condition, &left.ty) {
            (true, _) => Type::Bool,
            (false, Type::Int | Type::Double) if right.ty == Type::Real => Type::Real,
            (false, ty) => ty.clone(),
        };
        if let "==" | "!=" = sign
            && [&left.ty, &right.ty]
                .map(Type::referent)
                .iter()
                .any(|ty| matches!(ty, Type::Real | Type::Double))
        {
            // Compilers warn about comparing reals for equality; NaN equals nothing.
            let (left, right) = (left.at_least(11), right.at_least(11));
            let equal = format!("({left} <= {right} && {left} >= {right})");
            return Ok(match sign {
                "==" => Value::new(equal, ty, 16),
                _ => Value::new(format!("!{equal}"), ty, 15),
            });
        }
        // Numbers of Rust's reals are integers in C.
        let is_integer = left.is_literal() && right.is_literal() && ty == Type::Real;
        let cast = if is_integer { "(real)" } else { "" };
        // `a && b || c` has parentheses, as C's compilers ask for.
        let left_rank = if rank == 4 { 9 } else { rank };
        let right_rank = match rank {
            4 => 9,
            2 => 2,
            rank => rank + 1,
        };
        let (left, right) = (left.at_least(left_rank), right.at_least(right_rank));
        Ok(Value::new(format!("{cast}{left} {sign} {right}"), ty, rank))
    }

    fn reference(
        &mut self,
        here: &mut Instance<'_>,
        reference: &syn::ExprReference,
        expected: Option<&Type>,
    ) -> Found {
        let is_mutable = reference.mutability.is_some();
        if let Expr::Array(array) = reference.expr.as_ref()
            && array.elems.is_empty()
            && let Some(ty) = expected
        {
            return Ok(Value::new("NULL", ty.clone(), 16));
        }
        let value = self.value(here, &reference.expr)?;
        let ty = value.ty.clone().reference(is_mutable);
        Ok(match &value.ty {
            Type::Array(..) | Type::Slice(_) => Value { ty, ..value },
            Type::Ref(of, _) if matches!(of.as_ref(), Type::Slice(_) | Type::Array(..)) => Value {
                ty: of.as_ref().clone().reference(is_mutable),
                ..value
            },
            _ => Value::new(format!("&{}", value.at_least(15)), ty, 15),
        })
    }

    fn choice(
        &mut self,
        here: &mut Instance<'_>,
        branch: &syn::ExprIf,
        expected: Option<&Type>,
    ) -> Found {
        let condition = self.value(here, &branch.cond)?;
        let only = |block: &syn::Block| match block.stmts.as_slice() {
            [syn::Stmt::Expr(expression, None)] => Some(expression.clone()),
            _ => None,
        };
        let other = match branch.else_branch.as_ref().map(|(_, other)| other.as_ref()) {
            Some(Expr::Block(block)) => only(&block.block),
            Some(next @ Expr::If(_)) => Some(next.clone()),
            _ => None,
        };
        let (Some(first), Some(other)) = (only(&branch.then_branch), other) else {
            return Err(self.outside(here, branch, "a value of a block with statements"));
        };
        let first = self.value_as(here, &first, expected)?;
        let other = self.value_as(here, &other, expected)?.at_least(3);
        let (condition, value) = (condition.at_least(4), first.at_least(4));
        let text = format!("{condition} ? {value} : {other}");
        Ok(Value::new(text, first.ty, 3))
    }

    fn repeat(
        &mut self,
        here: &mut Instance<'_>,
        repeat: &syn::ExprRepeat,
        expected: Option<&Type>,
    ) -> Found {
        let expected = expected.and_then(Type::element);
        let element = self.value_as(here, &repeat.expr, expected)?;
        let length = self.items.length(here.function.source, &repeat.len)?;
        let ty = Type::Array(Box::new(element.ty.clone()), length);
        let ty = self.resolve(&ty, &here.sizes);
        let innermost = element.repeated.clone().unwrap_or(element.text.clone());
        Ok(Value {
            repeated: Some(innermost),
            ..Value::new(format!("{{{}}}", element.text), ty, 16)
        })
    }

    fn array(
        &mut self,
        here: &mut Instance<'_>,
        array: &syn::ExprArray,
        expected: Option<&Type>,
    ) -> Found {
        let Some(Type::Array(element, length)) = expected else {
            return Err(self.outside(here, array, "an array without a type in its `let`"));
        };
        let mut texts = Vec::new();
        for value in &array.elems {
            texts.push(self.value_as(here, value, Some(element))?.text);
        }
        let ty = Type::Array(element.clone(), length.clone());
        Ok(Value::new(format!("{{{}}}", texts.join(", ")), ty, 16))
    }

    fn struct_literal(&mut self, here: &mut Instance<'_>, literal: &syn::ExprStruct) -> Found {
        if literal.rest.is_some() {
            return Err(self.outside(here, literal, "the rest of another struct"));
        }
        let name = literal.path.segments.last().expect("a path has segments");
        let name = match name.ident.to_string() {
            name if name == "Self" => here.owner.to_owned(),
            name => name,
        };
        let mut fields_in_c = Vec::new();
        for field in &literal.fields {
            let syn::Member::Named(member) = &field.member else {
                return Err(self.outside(here, field, "a field without name"));
            };
            let mut fields = self.items.fields(&name).iter();
            let ty = fields.find(|of| *member == of.name).map(|of| &of.ty);
            let value = self.value_as(here, &field.expr, ty)?;
            if matches!(value.ty, Type::Array(..)) && value.repeated.is_none() {
                return Err(self.outside(here, field, "a field that is a copied array"));
            }
            fields_in_c.push(format!(".{member} = {}", value.text));
        }
        let text = format!("{{{}}}", fields_in_c.join(", "));
        let ty = self.resolve(&Type::Named(name), &BTreeMap::new());
        Ok(Value::new(text, ty, 16))
    }
}
