//! Structs, enums, constants and functions of the sources by name; needed types and constants come before functions.

use syn::{Attribute, FnArg, ImplItem, Item, ReturnType, Signature, TraitItem};

use super::*;
use crate::expression::operator;
use crate::text::snake;

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
    /// Why functions and types are left out, by their names in C.
    pub(crate) left_out: BTreeMap<String, Fault>,
    /// Structs, enums and traits of the sources, also those that are left out.
    type_names: BTreeSet<String>,
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
    pub(crate) body: Option<Block>,
}

/// Attributes, signature and body of a function.
type Parts<'s> = (&'s [Attribute], &'s Signature, Option<&'s Block>);

fn docs(attributes: &[Attribute]) -> Vec<String> {
    let line = |attribute: &Attribute| match &attribute.meta.require_name_value().ok()?.value {
        Expr::Lit(literal) if attribute.path().is_ident("doc") => match &literal.lit {
            syn::Lit::Str(text) => Some(text.value()),
            _ => None,
        },
        _ => None,
    };
    attributes.iter().filter_map(line).collect()
}

/// Whether an item is compiled under a condition only: copies for one processor, tests.
fn is_conditional(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|a| a.path().is_ident("cfg"))
}

fn type_name(item: &Item) -> Option<String> {
    match item {
        Item::Struct(syn::ItemStruct { ident, .. })
        | Item::Enum(syn::ItemEnum { ident, .. })
        | Item::Trait(syn::ItemTrait { ident, .. }) => Some(ident.to_string()),
        _ => None,
    }
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
            left_out: BTreeMap::new(),
            type_names: BTreeSet::new(),
        };
        let mut files = Vec::new();
        for Source { path, text } in sources {
            let file = syn::parse_file(text)
                .map_err(|error| Fault::at(path, error.span().start().line, error))?;
            let names = file.items.iter().filter_map(type_name);
            items.type_names.extend(names);
            files.push(file);
        }
        for (source, file) in files.iter().enumerate() {
            for item in &file.items {
                if let Item::Macro(table) = item
                    && table.mac.path.is_ident("settings")
                {
                    items.add_settings(source, table)?;
                } else if let Err(fault) = items.add(source, item)
                    && let Some(name) = type_name(item)
                {
                    items.left_out.insert(items.name(&[&name]), fault);
                }
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
        let line = at.span().start().line;
        Fault::at(&self.sources[source].path, line, message.into())
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

    /// The name of a function, of which the scalar's own have no owner.
    pub(crate) fn method(&self, owner: &str, name: &str) -> String {
        self.name(&[if owner == "Real" { "" } else { owner }, name])
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
            Item::Enum(item) => return Err(self.fault(source, &item.ident, "an enum with data")),
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
                self.add_function(source, "", (&item.attrs, &item.sig, Some(&item.block)));
            }
            Item::Trait(item) => {
                let owner = item.ident.to_string();
                for method in &item.items {
                    if let TraitItem::Fn(method) = method {
                        let parts = (&*method.attrs, &method.sig, method.default.as_ref());
                        self.add_function(source, &owner, parts);
                    }
                }
            }
            Item::Impl(item) if item.trait_.is_none() && !is_conditional(&item.attrs) => {
                let Type::Named(owner) = self.ty(source, &item.self_ty, "")? else {
                    return Ok(());
                };
                for method in &item.items {
                    if let ImplItem::Fn(method) = method {
                        let parts = (&*method.attrs, &method.sig, Some(&method.block));
                        self.add_function(source, &owner, parts);
                    }
                }
            }
            // `use`, `mod`, implementations of traits and conditionally compiled items are not translated.
            _ => {}
        }
        Ok(())
    }

    /// The settings in the C: `name: type,` after an arrow, or after `|` for further ones of a row.
    fn add_settings(&mut self, source: usize, item: &syn::ItemMacro) -> Found<()> {
        let table = item.mac.tokens.to_string();
        let words: Vec<&str> = table.split_whitespace().collect();
        let (docs, mut fields) = (Vec::new(), Vec::new());
        for words in words.windows(5) {
            if let ["=>" | "|", name, ":", ty, ","] = *words
                && let Ok(ty) = syn::parse_str(ty)
            {
                let ty = self.ty(source, &ty, "");
                let ty = ty.map_err(|fault| self.fault(source, item, fault.message))?;
                let (docs, name) = (Vec::new(), name.to_owned());
                fields.push(Field { docs, name, ty });
            }
        }
        (self.structs).insert("Settings".to_owned(), Struct { docs, fields });
        Ok(())
    }

    fn add_function(&mut self, source: usize, owner: &str, parts: Parts<'_>) {
        let name = parts.1.ident.to_string();
        match self.function(source, owner, parts) {
            Ok(function) => drop(self.functions.insert((owner.to_owned(), name), function)),
            Err(fault) => drop(self.left_out.insert(self.method(owner, &name), fault)),
        }
    }

    fn function(
        &self,
        source: usize,
        owner: &str,
        (attributes, signature, body): Parts<'_>,
    ) -> Found<Function> {
        let const_parameters = signature.generics.const_params();
        let const_parameters: Vec<String> = const_parameters
            .map(|size| size.ident.to_string())
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
        let parameters = signature.inputs.iter().map(parameter);
        let output = match &signature.output {
            ReturnType::Default => Type::Unit,
            ReturnType::Type(_, ty) => self.ty(source, ty, owner)?,
        };
        let is_own = |size: &&String| !SIZES.contains(&size.as_str());
        Ok(Function {
            docs: docs(attributes),
            source,
            sizes: const_parameters.iter().filter(is_own).cloned().collect(),
            const_parameters,
            parameters: parameters.collect::<Found<_>>()?,
            output,
            body: body.cloned(),
        })
    }

    /// A type as written; `owner` replaces `Self`.
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
                    name => {
                        let name = self.with_sizes(source, name, last)?;
                        let is_known = self.type_names.contains(&name);
                        if !is_known && self.unit.elsewhere(&name).is_none() {
                            let message = format!("an unknown type `{name}`");
                            return Err(self.fault(source, ty, message));
                        }
                        Type::Named(name)
                    }
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
            Some(other) => {
                let message = "arguments of a struct are T, NX, NU and LINKED";
                Err(self.fault(source, other, message))
            }
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
                let Some((operator, 12 | 13, _)) = operator(&binary.op) else {
                    return Err(self.fault(source, length, "an operator in a length"));
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
            self.write_type(name, &mut header, &mut written)?;
        }
        for name in &self.constants {
            source += &self.constant_text(name, true)?;
        }
        for name in &self.types {
            self.write_type(name, &mut source, &mut written)?;
        }
        for name in &self.constants {
            source += &self.constant_text(name, false)?;
        }
        source += &self.functions;
        Ok(Translated { header, source })
    }

    /// A constant, if it is a number or is not, as requested.
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

    /// A struct or enum, after the types of its fields.
    fn write_type(&self, name: &str, out: &mut String, done: &mut BTreeSet<String>) -> Found<()> {
        if self.items.unit.elsewhere(name).is_some() || !done.insert(name.to_owned()) {
            return Ok(());
        }
        let c_name = self.items.name(&[name]);
        if let Some((docs, variants)) = self.items.enums.get(name) {
            let variants = variants.iter().map(|of| self.items.constant_name(of));
            let variants = variants.collect::<Vec<_>>().join(", ");
            let docs = comment(docs, "");
            *out += &format!("{docs}typedef enum {{ {variants} }} {c_name};\n\n");
            return Ok(());
        }
        let Some(found) = self.items.structs.get(name) else {
            return (self.items.left_out.get(&c_name)).map_or(Ok(()), |fault| Err(fault.clone()));
        };
        for of in found.fields.iter().filter_map(|field| field.ty.named()) {
            self.write_type(of, out, done)?;
        }
        let mut text = format!("{}typedef struct {{\n", comment(&found.docs, ""));
        for field in &found.fields {
            let mut in_c = |length: &str| self.length(length, &BTreeMap::new());
            let ty = field.ty.with_lengths(&mut in_c);
            let declared = ty.declare(&field.name, &|of| self.spelling(of));
            text += &format!("{}    {declared};\n", comment(&field.docs, "    "));
            let key = (name.to_owned(), field.name.clone());
            if self.lengths.contains(&key) {
                text += &format!("    int {}_len;\n", field.name);
            }
        }
        *out += &format!("{text}}} {c_name};\n\n");
        Ok(())
    }
}
