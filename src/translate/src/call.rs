//! Calls: which function of the sources they mean, and its const arguments.

use super::*;

impl Writer<'_> {
    pub(crate) fn call(
        &mut self,
        here: &mut Instance<'_>,
        call: &syn::ExprCall,
        expected: Option<&Type>,
    ) -> Found {
        let Expr::Path(path) = call.func.as_ref() else {
            return Err(self.outside(here, call, "a call of a value"));
        };
        let segments = &path.path.segments;
        let name = segments.last().expect("a path has segments");
        let owner = segments.iter().rev().nth(1);
        let owner = owner.map_or(String::new(), |owner| owner.ident.to_string());
        let is_own = owner == "Self";
        let owner = if is_own { here.owner } else { &owner };
        match (owner, name.ident.to_string().as_str()) {
            ("T", "of") => {
                let value = self.value(here, &call.args[0])?;
                let text = format!("(real){}", value.at_least(15));
                Ok(Value::new(text, Type::Real, 15))
            }
            ("", "part" | "part_mut") => {
                let Some(ty) = expected else {
                    let what = "a part without a type in its `let`";
                    return Err(self.outside(here, call, what));
                };
                let whole = self.value(here, &call.args[0])?;
                let first = self.value(here, &call.args[1])?;
                let text = format!("{} + {}", whole.at_least(12), first.at_least(13));
                Ok(Value::new(text, ty.clone(), 12))
            }
            (owner, function) => {
                let key = (owner.to_owned(), function.to_owned());
                let items = self.items;
                let Some((key, function)) = items.functions.get_key_value(&key) else {
                    return Err(self.outside(here, call, "a function from elsewhere"));
                };
                let arguments: Vec<&Expr> = call.args.iter().collect();
                self.apply(here, key, function, None, &arguments, &name.arguments)
            }
        }
    }

    pub(crate) fn method(&mut self, here: &mut Instance<'_>, call: &syn::ExprMethodCall) -> Found {
        let method = call.method.to_string();
        let receiver = self.value(here, &call.receiver)?;
        if method == "len"
            && let (Expr::Field(field), Type::Slice(_)) =
                (call.receiver.as_ref(), receiver.ty.referent())
            && let syn::Member::Named(name) = &field.member
            && let Type::Named(of) = self.value(here, &field.base)?.ty.referent()
        {
            self.lengths.insert((of.clone(), name.to_string()));
            return Ok(Value::new(format!("{}_len", receiver.text), Type::Int, 16));
        }
        if let Some(value) = of_libm(&receiver, &method) {
            return Ok(value);
        }
        if let Some(name) = self.items.unit.elsewhere(&method) {
            return Ok(Value::new(name, Type::Bool, 16));
        }
        let owner = match receiver.ty.referent() {
            Type::Real => "Real",
            Type::Named(name) => name,
            _ => return Err(self.outside(here, call, "a method of this")),
        };
        let items = self.items;
        let Some((key, function)) = (items.functions).get_key_value(&(owner.to_owned(), method))
        else {
            return Err(self.outside(here, call, "a method from elsewhere"));
        };
        let receiver = match (&function.parameters[0].1, &receiver.ty) {
            (Type::Ref(..), of) if !matches!(of, Type::Ref(..)) => {
                let ty = of.clone().reference(true);
                Value::new(format!("&{}", receiver.at_least(15)), ty, 15)
            }
            _ => receiver,
        };
        let arguments: Vec<&Expr> = call.args.iter().collect();
        let given = match &call.turbofish {
            Some(given) => syn::PathArguments::AngleBracketed(given.clone()),
            None => syn::PathArguments::None,
        };
        self.apply(here, key, function, Some(receiver), &arguments, &given)
    }

    /// A call: its const arguments follow from the types of the others, or are given.
    fn apply(
        &mut self,
        here: &mut Instance<'_>,
        (owner, name): &(String, String),
        function: &Function,
        receiver: Option<Value>,
        arguments: &[&Expr],
        given: &syn::PathArguments,
    ) -> Found {
        let mut sizes: BTreeMap<String, String> = BTreeMap::new();
        if let syn::PathArguments::AngleBracketed(given) = given {
            let lengths = given.args.iter().filter_map(|argument| match argument {
                syn::GenericArgument::Const(value) => Some(value.clone()),
                syn::GenericArgument::Type(syn::Type::Path(path)) if !path.path.is_ident("T") => {
                    Some(syn::parse_quote!(#path))
                }
                _ => None,
            });
            for (parameter, length) in function.const_parameters.iter().zip(lengths) {
                let length = self.value(here, &length)?.text;
                sizes.insert(parameter.clone(), length);
            }
        }
        let skipped = usize::from(receiver.is_some());
        let mut texts: Vec<String> = receiver.iter().map(|value| value.text.clone()).collect();
        for ((_, ty, _), argument) in function.parameters.iter().skip(skipped).zip(arguments) {
            let ty = &self.resolve(ty, &BTreeMap::new());
            let value = self.value_as(here, argument, Some(ty))?;
            if matches!(ty, Type::Ref(..)) && !matches!(value.ty, Type::Ref(..)) {
                return Err(self.outside(here, argument, "a value in place of a reference"));
            }
            if !infer(ty, &value.ty, &function.const_parameters, &mut sizes) {
                let message = format!("{:?} where `{name}` has {ty:?}", value.ty);
                return Err(self.outside(here, argument, &message));
            }
            texts.push(value.text);
        }
        for (parameter, size) in &sizes {
            if !function.sizes.contains(parameter) && parameter != size {
                let message = format!("`{name}` for {parameter} = {size}");
                return Err(self.outside(here, arguments[0], &message));
            }
        }
        sizes.retain(|parameter, _| function.sizes.contains(parameter));
        let mut own = function.sizes.iter();
        if let Some(missing) = own.find(|size| !sizes.contains_key(*size)) {
            let message = format!("`{name}` with unknown {missing}");
            return Err(self.outside(here, arguments[0], &message));
        }
        let output = self.resolve(&function.output, &sizes);
        let c_name = self.function(owner, name, function, sizes)?;
        let text = format!("{c_name}({})", texts.join(", "));
        Ok(Value::new(text, output, 16))
    }
}

/// A method of the standard library's numbers as whoever includes the C has it.
fn of_libm(receiver: &Value, method: &str) -> Option<Value> {
    let (function, ty) = match (&receiver.ty, method) {
        (Type::Real, "sqrt" | "exp" | "sin" | "cos" | "tanh") => {
            (method.to_ascii_uppercase(), Type::Real)
        }
        (Type::Double, "floor") => (method.to_ascii_uppercase(), Type::Double),
        (Type::Real, "abs") => ("solver_magnitude".to_owned(), Type::Real),
        (Type::Real, "is_finite") => ("solver_is_finite_number".to_owned(), Type::Bool),
        (Type::Double, "is_finite") => ("is_finite_double".to_owned(), Type::Bool),
        _ => return None,
    };
    Some(Value::new(format!("{function}({})", receiver.text), ty, 16))
}

/// Whether an argument fits a parameter; lengths that are const parameters become known.
fn infer(
    parameter: &Type,
    argument: &Type,
    names: &[String],
    sizes: &mut BTreeMap<String, String>,
) -> bool {
    match (parameter, argument) {
        (Type::Ref(of, is_mutable), Type::Ref(given, given_mutable)) => {
            (*given_mutable || !is_mutable) && infer(of, given, names, sizes)
        }
        (Type::Slice(of), Type::Slice(given) | Type::Array(given, _)) => {
            infer(of, given, names, sizes)
        }
        (Type::Array(of, length), Type::Array(given, given_length)) => {
            let fits = match names.contains(length) {
                true => {
                    let known = sizes.entry(length.clone());
                    *known.or_insert(given_length.clone()) == *given_length
                }
                false => length == given_length,
            };
            fits && infer(of, given, names, sizes)
        }
        (parameter, argument) => parameter == argument,
    }
}
