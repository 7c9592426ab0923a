//! Structs, enums, constants and functions of the sources by name; needed types and constants come before functions.

use std::collections::{BTreeMap, BTreeSet};

use syn::spanned::Spanned;
use syn::{Expr, FnArg, GenericParam, ImplItem, Item, Pat, ReturnType, TraitItem};

use crate::function::Writer;
use crate::text::{comment, snake};
use crate::types::Type;
use crate::{Fault, Found, Source, Translated, Unit};

/// Const parameters that stay names in C.
pub(crate) const SIZES: [&str; 2] = ["NX", "NU"];

/// A struct or enum, a constant or a function belongs to a source, of which faults name the path.
pub(crate) struct Items<'a> {
    pub(crate) unit: Unit<'a>,
    sources: &'a [Source],
    pub(crate) structs: BTreeMap<String, Struct>,
    pub(crate) enums: BTreeMap<String, (Vec<String>, Vec<String>)>,
    pub(crate) constants: BTreeMap<String, Constant>,
    /// By owner and name; functions without one have an empty owner. The trait `Real` is the scalar; any other is a
    /// struct of C, its required methods are functions that whoever includes the C defines.
    pub(crate) functions: BTreeMap<(String, String), Function>,
}

pub(crate) struct Struct {
    pub(crate) docs: Vec<String>,
    pub(crate) fields: Vec<Field>,
}

pub(crate) struct Field {
    pub(crate) docs: Vec<String>,
    pub(crate) name: String,
    pub(crate) ty: Type,
}

pub(crate) struct Constant {
    pub(crate) docs: Vec<String>,
    pub(crate) source: usize,
    pub(crate) ty: Type,
    pub(crate) value: Expr,
}

pub(crate) struct Function {
    pub(crate) docs: Vec<String>,
    pub(crate) source: usize,
    /// Const parameters of its own, which [`SIZES`] are not.
    pub(crate) sizes: Vec<String>,
    pub(crate) const_parameters: Vec<String>,
    /// Name, type, and whether the function changes its copy.
    pub(crate) parameters: Vec<(String, Type, bool)>,
    pub(crate) output: Type,
    /// None of a function that is defined elsewhere.
    pub(crate) body: Option<syn::Block>,
}

fn docs(attributes: &[syn::Attribute]) -> Vec<String> {
    let line = |attribute: &syn::Attribute| match &attribute.meta {
        syn::Meta::NameValue(pair) if pair.path.is_ident("doc") => match &pair.value {
            Expr::Lit(syn::ExprLit {
                lit: syn::Lit::Str(text),
                ..
            }) => Some(text.value()),
            _ => None,
        },
        _ => None,
    };
    attributes.iter().filter_map(line).collect()
}

/// Whether an item is compiled under a condition only: copies for one processor, tests.
fn is_conditional(attributes: &[syn::Attribute]) -> bool {
    attributes.iter().any(|a| a.path().is_ident("cfg"))
}

impl<'a> Items<'a> {
    pub(crate) fn read(sources: &'a [Source], unit: &Unit<'a>) -> Result<Self, Fault> {
        let mut items = Self {
            unit: *unit,
            sources,
            structs: BTreeMap::new(),
            enums: BTreeMap::new(),
            constants: BTreeMap::new(),
            functions: BTreeMap::new(),
        };
        for (source, Source { path, text }) in sources.iter().enumerate() {
            let file = syn::parse_file(text).map_err(|error| Fault {
                path: path.clone(),
                line: error.span().start().line,
                message: error.to_string(),
            })?;
            for item in &file.items {
                let _ = match item {
                    Item::Macro(item) if item.mac.path.is_ident("settings") => {
                        items.add_settings(source, item)
                    }
                    _ => items.add(source, item),
                };
            }
        }
        Ok(items)
    }

    pub(crate) fn fault(
        &self,
        source: usize,
        at: &impl Spanned,
        message: impl Into<String>,
    ) -> Fault {
        Fault {
            path: self.sources[source].path.clone(),
            line: at.span().start().line,
            message: message.into(),
        }
    }

    /// The line comments directly above a line, in their order.
    pub(crate) fn comments_above(&self, source: usize, at: &impl Spanned) -> Vec<String> {
        let first = at.span().start().line.saturating_sub(1);
        let lines: Vec<&str> = self.sources[source].text.lines().take(first).collect();
        let above = lines.iter().rev().map_while(|line| {
            let text = line.trim().strip_prefix("//")?;
            (!text.starts_with('/')).then(|| text.trim().to_owned())
        });
        let mut above: Vec<String> = above.collect();
        above.reverse();
        above
    }

    pub(crate) fn fields(&self, name: &str) -> &[Field] {
        self.structs.get(name).map_or(&[], |found| &found.fields)
    }

    /// A name of C: `solver_before`, `solver_before_write`.
    pub(crate) fn name(&self, parts: &[&str]) -> String {
        let words = parts.iter().filter(|part| !part.is_empty());
        let words: Vec<String> = words.map(|part| snake(part)).collect();
        format!("{}_{}", self.unit.prefix, words.join("_"))
    }

    pub(crate) fn constant_name(&self, name: &str) -> String {
        match name.chars().any(|letter| letter.is_ascii_lowercase()) {
            true => self.name(&[name]).to_ascii_uppercase(),
            false => format!("{}_{name}", self.unit.prefix.to_ascii_uppercase()),
        }
    }

    /// Items outside the subset are left out: they are faults where the C needs them.
    fn add(&mut self, source: usize, item: &Item) -> Found<()> {
        match item {
            Item::Struct(item) if !is_conditional(&item.attrs) => {
                let field = |field: &syn::Field| {
                    let name = field.ident.as_ref().map(ToString::to_string);
                    Ok(Field {
                        docs: docs(&field.attrs),
                        name: name
                            .ok_or_else(|| self.fault(source, field, "a field without name"))?,
                        ty: self.ty(source, &field.ty, "")?,
                    })
                };
                let fields = item.fields.iter().map(field).collect::<Found<_>>()?;
                let docs = docs(&item.attrs);
                self.structs
                    .insert(item.ident.to_string(), Struct { docs, fields });
            }
            Item::Enum(item) if item.variants.iter().all(|v| v.fields.is_empty()) => {
                let names = item.variants.iter().map(|v| v.ident.to_string());
                let plain = (docs(&item.attrs), names.collect());
                self.enums.insert(item.ident.to_string(), plain);
            }
            Item::Const(item) => {
                let constant = Constant {
                    docs: docs(&item.attrs),
                    source,
                    ty: self.ty(source, &item.ty, "")?,
                    value: (*item.expr).clone(),
                };
                self.constants.insert(item.ident.to_string(), constant);
            }
            Item::Fn(item) if !is_conditional(&item.attrs) => {
                self.add_function(source, "", &item.attrs, &item.sig, Some(&item.block))?;
            }
            Item::Trait(item) => {
                let owner = item.ident.to_string();
                for method in &item.items {
                    if let TraitItem::Fn(method) = method {
                        let (attributes, body) = (&method.attrs, method.default.as_ref());
                        let _ = self.add_function(source, &owner, attributes, &method.sig, body);
                    }
                }
            }
            Item::Impl(item) if item.trait_.is_none() && !is_conditional(&item.attrs) => {
                let Type::Named(owner) = self.ty(source, &item.self_ty, "")? else {
                    return Ok(());
                };
                for method in &item.items {
                    if let ImplItem::Fn(method) = method {
                        let (attributes, body) = (&method.attrs, Some(&method.block));
                        let _ = self.add_function(source, &owner, attributes, &method.sig, body);
                    }
                }
            }
            // `use`, `mod`, implementations of traits and what is compiled under a condition: nothing to translate.
            _ => {}
        }
        Ok(())
    }

    /// The settings that C has: `name: type,` behind an arrow, or behind `|` for more of one row.
    fn add_settings(&mut self, source: usize, table: &syn::ItemMacro) -> Found<()> {
        let table = table.mac.tokens.to_string();
        let words: Vec<&str> = table.split_whitespace().collect();
        let (docs, mut fields) = (Vec::new(), Vec::new());
        for words in words.windows(5) {
            if let ["=>" | "|", name, ":", ty, ","] = *words
                && let Ok(ty) = syn::parse_str(ty)
            {
                let (ty, name) = (self.ty(source, &ty, "")?, name.to_owned());
                fields.push(Field {
                    docs: Vec::new(),
                    name,
                    ty,
                });
            }
        }
        (self.structs).insert("Settings".to_owned(), Struct { docs, fields });
        Ok(())
    }

    fn add_function(
        &mut self,
        source: usize,
        owner: &str,
        attributes: &[syn::Attribute],
        signature: &syn::Signature,
        body: Option<&syn::Block>,
    ) -> Found<()> {
        let const_parameters: Vec<String> = (signature.generics.params.iter())
            .filter_map(|parameter| match parameter {
                GenericParam::Const(size) => Some(size.ident.to_string()),
                _ => None,
            })
            .collect();
        let parameter = |input: &FnArg| match input {
            FnArg::Receiver(receiver) => {
                let of = match owner {
                    "Real" => Type::Real,
                    owner => Type::Named(owner.to_owned()),
                };
                let ty = match receiver.reference {
                    Some(_) => of.reference(receiver.mutability.is_some()),
                    None => of,
                };
                Ok(("self".to_owned(), ty, false))
            }
            FnArg::Typed(typed) => {
                let Pat::Ident(name) = typed.pat.as_ref() else {
                    return Err(self.fault(source, typed, "a parameter that is a pattern"));
                };
                let ty = self.ty(source, &typed.ty, owner)?;
                if matches!(ty, Type::Array(..)) {
                    return Err(self.fault(source, typed, "an array by value: pass a reference"));
                }
                Ok((name.ident.to_string(), ty, name.mutability.is_some()))
            }
        };
        let parameters = signature
            .inputs
            .iter()
            .map(parameter)
            .collect::<Found<_>>()?;
        let output = match &signature.output {
            ReturnType::Default => Type::Unit,
            ReturnType::Type(_, ty) => self.ty(source, ty, owner)?,
        };
        let is_own = |size: &&String| !SIZES.contains(&size.as_str());
        let function = Function {
            docs: docs(attributes),
            source,
            sizes: const_parameters.iter().filter(is_own).cloned().collect(),
            const_parameters,
            parameters,
            output,
            body: body.cloned(),
        };
        let key = (owner.to_owned(), signature.ident.to_string());
        self.functions.insert(key, function);
        Ok(())
    }

    /// A type as it is written; `owner` is what `Self` stands for.
    pub(crate) fn ty(&self, source: usize, ty: &syn::Type, owner: &str) -> Result<Type, Fault> {
        Ok(match ty {
            syn::Type::Reference(reference) => {
                let of = self.ty(source, &reference.elem, owner)?;
                of.reference(reference.mutability.is_some())
            }
            syn::Type::Slice(slice) => {
                Type::Slice(Box::new(self.ty(source, &slice.elem, owner)?))
            }
            syn::Type::Array(array) => {
                let element = self.ty(source, &array.elem, owner)?;
                Type::Array(Box::new(element), self.length(source, &array.len)?)
            }
            syn::Type::Path(path) => {
                let last = path.path.segments.last().expect("a path has segments");
                match last.ident.to_string().as_str() {
                    "T" | "Real" => Type::Real,
                    "Self" if owner == "Real" => Type::Real,
                    "Self" => Type::Named(owner.to_owned()),
                    "f64" => Type::Double,
                    "usize" | "u32" | "i32" => Type::Int,
                    "bool" => Type::Bool,
                    name => Type::Named(self.with_sizes(source, name, last)?),
                }
            }
            syn::Type::ImplTrait(of) => match of.bounds.first() {
                Some(syn::TypeParamBound::Trait(bound)) => {
                    let name = bound.path.segments.last().expect("a path has segments");
                    Type::Named(name.ident.to_string())
                }
                _ => return Err(self.fault(source, of, "a type outside the subset")),
            },
            other => return Err(self.fault(source, other, "a type outside the subset")),
        })
    }

    /// The name of a struct whose const arguments are the names that its parameters have.
    fn with_sizes(&self, source: usize, name: &str, segment: &syn::PathSegment) -> Found<String> {
        let syn::PathArguments::AngleBracketed(arguments) = &segment.arguments else {
            return Ok(name.to_owned());
        };
        let is_plain = |argument: &&syn::GenericArgument| match argument {
            syn::GenericArgument::Lifetime(_) => true,
            syn::GenericArgument::Type(syn::Type::Path(of)) => ["T", "NX", "NU", "LINKED"]
                .iter()
                .any(|name| of.path.is_ident(name)),
            _ => false,
        };
        match arguments.args.iter().find(|argument| !is_plain(argument)) {
            None => Ok(name.to_owned()),
            Some(other) => Err(self.fault(
                source,
                other,
                "arguments of a struct are T, NX, NU and LINKED",
            )),
        }
    }

    pub(crate) fn length(&self, source: usize, length: &Expr) -> Found<String> {
        Ok(match length {
            Expr::Lit(syn::ExprLit {
                lit: syn::Lit::Int(number),
                ..
            }) => number.base10_digits().to_owned(),
            Expr::Path(path) => match path.path.get_ident().map(ToString::to_string) {
                Some(name) => name,
                None => return Err(self.fault(source, length, "a length that is a path")),
            },
            Expr::Binary(binary) => {
                let left = self.length(source, &binary.left)?;
                let right = self.length(source, &binary.right)?;
                let operator = match binary.op {
                    syn::BinOp::Add(_) => "+",
                    syn::BinOp::Sub(_) => "-",
                    syn::BinOp::Mul(_) => "*",
                    syn::BinOp::Div(_) => "/",
                    _ => return Err(self.fault(source, length, "an operator in a length")),
                };
                format!("{left} {operator} {right}")
            }
            other => return Err(self.fault(source, other, "a length outside the subset")),
        })
    }
}

impl Writer<'_> {
    pub(crate) fn finish(self, unit: &Unit<'_>) -> Result<Translated, Fault> {
        let mut header = String::new();
        let mut source = String::new();
        let mut written = BTreeSet::new();
        for name in unit.header {
            self.write_type(name, &mut header, &mut written);
        }
        for name in &self.constants {
            source += &self.constant_text(name, true)?;
        }
        for name in &self.types {
            self.write_type(name, &mut source, &mut written);
        }
        for name in &self.constants {
            source += &self.constant_text(name, false)?;
        }
        source += &self.functions;
        Ok(Translated { header, source })
    }

    /// A constant, if it is a number or is none, as is asked for.
    fn constant_text(&self, name: &str, is_number: bool) -> Found<String> {
        let constant = &self.items.constants[name];
        if constant.ty.is_number() != is_number {
            return Ok(String::new());
        }
        let value = crate::expression::constant(self.items, constant.source, &constant.value)?;
        let (docs, name) = (comment(&constant.docs, ""), self.items.constant_name(name));
        let declared = constant.ty.declare(&name, &|of| self.spelling(of));
        Ok(match &constant.ty {
            Type::Real => format!("{docs}#define {name} (real){value}\n\n"),
            _ if is_number => format!("{docs}#define {name} {value}\n\n"),
            _ => format!("{docs}static const {declared} = {value};\n\n"),
        })
    }

    /// A struct or enum, behind those that its fields are made of.
    fn write_type(&self, name: &str, out: &mut String, written: &mut BTreeSet<String>) {
        if self.items.unit.elsewhere(name).is_some() || !written.insert(name.to_owned()) {
            return;
        }
        let c_name = self.items.name(&[name]);
        if let Some((docs, variants)) = self.items.enums.get(name) {
            let variants: Vec<String> = (variants
                .iter()
                .map(|variant| self.items.constant_name(variant)))
            .collect();
            let (docs, variants) = (comment(docs, ""), variants.join(", "));
            *out += &format!("{docs}typedef enum {{ {variants} }} {c_name};\n\n");
            return;
        }
        let Some(found) = self.items.structs.get(name) else {
            return;
        };
        for of in found.fields.iter().filter_map(|field| field.ty.named()) {
            self.write_type(of, out, written);
        }
        let mut text = format!("{}typedef struct {{\n", comment(&found.docs, ""));
        for field in &found.fields {
            let ty = field
                .ty
                .with_lengths(&mut |length| self.length(length, &BTreeMap::new()));
            let declared = ty.declare(&field.name, &|of| self.spelling(of));
            text += &format!("{}    {declared};\n", comment(&field.docs, "    "));
            let key = (name.to_owned(), field.name.clone());
            if self.lengths.contains(&key) {
                text += &format!("    int {}_len;\n", field.name);
            }
        }
        *out += &format!("{text}}} {c_name};\n\n");
    }
}
