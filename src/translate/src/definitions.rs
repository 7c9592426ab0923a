//! Structs, enums and constants that the functions need, before the functions' text.

use std::collections::BTreeSet;

use crate::function::Writer;
use crate::text::comment;
use crate::types::Type;
use crate::{Fault, Found, Translated, Unit};

impl Writer<'_> {
    /// The text of all that the functions need, and theirs.
    pub(crate) fn finish(self, unit: &Unit<'_>) -> Result<Translated, Fault> {
        let mut header = String::new();
        let mut source = String::new();
        let mut written = BTreeSet::new();
        for name in unit.header {
            self.write_type(name, &mut header, &mut written);
        }
        for name in self.constants.iter() {
            source += &self.scalar_constant(name)?;
        }
        for name in &self.types {
            self.write_type(name, &mut source, &mut written);
        }
        for name in self.constants.iter() {
            source += &self.struct_constant(name)?;
        }
        source += &self.functions;
        Ok(Translated { header, source })
    }

    fn scalar_constant(&self, name: &str) -> Found<String> {
        let constant = &self.items.constants[name];
        if !constant.ty.is_number() {
            return Ok(String::new());
        }
        let value = crate::expression::constant(self.items, constant.source, &constant.value)?;
        let docs = comment(&constant.docs, "");
        let cast = if constant.ty == Type::Real {
            "(real)"
        } else {
            ""
        };
        Ok(format!(
            "{docs}#define {} {cast}{value}\n\n",
            self.items.constant_name(name)
        ))
    }

    fn struct_constant(&self, name: &str) -> Found<String> {
        let constant = &self.items.constants[name];
        if constant.ty.is_number() {
            return Ok(String::new());
        }
        let value = crate::expression::constant(self.items, constant.source, &constant.value)?;
        let declared =
            (constant.ty).declare(&self.items.constant_name(name), &|of| self.spelling(of));
        let docs = comment(&constant.docs, "");
        Ok(format!("{docs}static const {declared} = {value};\n\n"))
    }

    /// A struct or enum, behind those that its fields are made of.
    fn write_type(&self, name: &str, out: &mut String, written: &mut BTreeSet<String>) {
        if !written.insert(name.to_owned()) {
            return;
        }
        let c_name = self.spelling(name);
        if let Some((docs, variants)) = self.items.enums.get(name) {
            let variants = variants
                .iter()
                .map(|variant| self.items.constant_name(variant));
            let variants: Vec<String> = variants.collect();
            let docs = comment(docs, "");
            *out += &format!(
                "{docs}typedef enum {{ {} }} {c_name};\n\n",
                variants.join(", ")
            );
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
            let ty = field.ty.with_lengths(&mut |length| {
                let word = |word: &str| match self.items.unit.elsewhere(word) {
                    Some(name) => name.to_owned(),
                    None if self.items.constants.contains_key(word) => {
                        self.items.constant_name(word)
                    }
                    None => word.to_owned(),
                };
                length.split(' ').map(word).collect::<Vec<_>>().join(" ")
            });
            let declared = ty.declare(&field.name, &|of| self.spelling(of));
            text += &format!("{}    {declared};\n", comment(&field.docs, "    "));
            if self
                .lengths
                .contains(&(name.to_owned(), field.name.clone()))
            {
                text += &format!("    int {}_len;\n", field.name);
            }
        }
        *out += &format!("{text}}} {c_name};\n\n");
    }
}
