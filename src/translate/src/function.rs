//! Functions: which are needed, and their order.

use super::*;
use crate::statement::Lines;
use crate::text::wrapped;

/// The text of the functions, callees first, and the items that they need.
pub(crate) struct Writer<'a> {
    pub(crate) items: &'a Items<'a>,
    pub(crate) functions: String,
    /// Functions by name in C: done or defined elsewhere, or begun.
    pub(crate) done: BTreeMap<String, bool>,
    pub(crate) types: BTreeSet<String>,
    pub(crate) constants: BTreeSet<String>,
    /// Fields whose length is read, by struct and name.
    pub(crate) lengths: BTreeSet<(String, String)>,
}

/// A function with values of its const parameters.
pub(crate) struct Instance<'f> {
    pub(crate) function: &'f Function,
    pub(crate) owner: &'f str,
    pub(crate) sizes: BTreeMap<String, String>,
    /// Variables of the blocks that are open, the innermost last.
    pub(crate) scopes: Vec<BTreeMap<String, Type>>,
    pub(crate) output: Type,
    pub(crate) lines: Lines,
}

impl Instance<'_> {
    pub(crate) fn variable(&self, name: &str) -> Option<&Type> {
        self.scopes.iter().rev().find_map(|scope| scope.get(name))
    }
}

impl<'a> Writer<'a> {
    pub(crate) fn new(items: &'a Items<'a>) -> Self {
        Self {
            items,
            functions: String::new(),
            done: BTreeMap::new(),
            types: BTreeSet::new(),
            constants: BTreeSet::new(),
            lengths: BTreeSet::new(),
        }
    }

    /// A type with lengths as C has them; the structs and constants that it names are needed.
    pub(crate) fn resolve(&mut self, ty: &Type, sizes: &BTreeMap<String, String>) -> Type {
        if let Some(name) = ty.named() {
            self.need_type(name);
        }
        ty.with_lengths(&mut |length| {
            for word in length.split(' ') {
                let is_known =
                    self.items.unit.elsewhere(word).is_some() || sizes.contains_key(word);
                if !is_known && self.items.constants.contains_key(word) {
                    self.constant(word);
                }
            }
            self.length(length, sizes)
        })
    }

    pub(crate) fn length(&self, length: &str, sizes: &BTreeMap<String, String>) -> String {
        let word = |word: &str| match (self.items.unit.elsewhere(word), sizes.get(word)) {
            (Some(name), _) => name.to_owned(),
            (None, Some(size)) => size.clone(),
            (None, None) if self.items.constants.contains_key(word) => {
                self.items.constant_name(word)
            }
            (None, None) => word.to_owned(),
        };
        length.split(' ').map(word).collect::<Vec<_>>().join(" ")
    }

    fn need_type(&mut self, name: &str) {
        if !self.types.insert(name.to_owned()) {
            return;
        }
        let items = self.items;
        for field in items.fields(name) {
            self.resolve(&field.ty, &BTreeMap::new());
        }
    }

    /// The name of a constant, which is needed.
    pub(crate) fn constant(&mut self, name: &str) -> String {
        self.constants.insert(name.to_owned());
        let items = self.items;
        if let Some(of) = items.constants[name].ty.named() {
            self.need_type(of);
        }
        items.constant_name(name)
    }

    pub(crate) fn spelling(&self, name: &str) -> String {
        let is_fixed = self.items.unit.fixed.contains(&name);
        let start = if is_fixed { "const " } else { "" };
        format!("{start}{}", self.items.name(&[name]))
    }

    /// Writes a function for sizes unless that was done; its name.
    pub(crate) fn function(
        &mut self,
        owner: &str,
        name: &str,
        function: &Function,
        sizes: BTreeMap<String, String>,
    ) -> Found<String> {
        let prefix = self.items.unit.prefix.to_ascii_uppercase() + "_";
        let size = |size: &String| sizes[size].replace(&prefix, "").replace(' ', "");
        let mut c_name = self.items.method(owner, name);
        for own in &function.sizes {
            c_name += &format!("_{}", size(own).to_ascii_lowercase());
        }
        match self.done.get(&c_name) {
            Some(true) => return Ok(c_name),
            Some(false) => {
                let message = format!("`{name}` calls itself");
                return Err(self.items.fault(function.source, &function.body, message));
            }
            None => {}
        }
        self.done.insert(c_name.clone(), function.body.is_none());
        let Some(body) = &function.body else {
            return Ok(c_name);
        };
        let text = self.definition(&c_name, owner, (function, body), sizes)?;
        self.functions += &text;
        self.done.insert(c_name.clone(), true);
        Ok(c_name)
    }

    fn definition(
        &mut self,
        c_name: &str,
        owner: &str,
        (function, body): (&Function, &syn::Block),
        sizes: BTreeMap<String, String>,
    ) -> Found<String> {
        let mut scope = BTreeMap::new();
        let mut declared = Vec::new();
        let is_pointer = |ty: &Type| matches!(ty, Type::Ref(..));
        let types = function.parameters.iter().map(|(_, ty, _)| ty);
        let has_others = types.filter(|ty| is_pointer(ty)).count() > 1;
        for (name, ty, _) in &function.parameters {
            let ty = self.resolve(ty, &sizes);
            declared.push(ty.parameter(name, has_others, &|of| self.spelling(of)));
            scope.insert(name.clone(), ty);
        }
        let output = self.resolve(&function.output, &sizes);
        let mut here = Instance {
            function,
            owner,
            sizes,
            scopes: vec![scope],
            output: output.clone(),
            lines: Lines::default(),
        };
        if declared.is_empty() {
            declared.push("void".to_owned());
        }
        let signature = format!("{c_name}({})", declared.join(", "));
        let signature = output.declare(&signature, &|of| self.spelling(of));
        let attribute = self.items.unit.attribute;
        (here.lines).add(&format!("static {attribute}{signature}"));
        here.lines.open("{");
        self.block(&mut here, body, true)?;
        here.lines.close("}");
        let docs = comment(&function.docs, "");
        Ok(format!("{docs}{}\n", wrapped(&here.lines.text)))
    }
}
