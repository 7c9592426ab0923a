//! What pages of Markdown and HTML are made of.

use askama::Template;

use super::equations::{EquationSystem, Typeset};
use super::symbols::PrintOptions;
use super::words::{self, Spelling};
use crate::equations::Equations;

/// Longest line of an equation unless chosen, in em.
const WIDTH_EM: f64 = 44.0;

pub(super) struct Page<'a> {
    pub equations: &'a Equations<'a>,
    pub spelling: &'a Spelling,
    pub typeset: Typeset,
    pub rounding: String,
    width_em: f64,
    pub digest: Option<&'a str>,
    pub version: &'static str,
}

impl<'a> Page<'a> {
    pub(super) fn new(
        equations: &'a Equations<'a>,
        options: &'a PrintOptions,
        spelling: &'a Spelling,
    ) -> Self {
        let typeset = Typeset::new(equations, &options.symbols, options.rounding);
        Self {
            equations,
            spelling,
            rounding: words::rounding(spelling, options.rounding, &typeset.rounding),
            typeset,
            width_em: options.width_em.unwrap_or(WIDTH_EM),
            digest: options.digest.as_deref(),
            version: env!("CARGO_PKG_VERSION"),
        }
    }

    /// Name, feet and equations of each phase.
    pub(super) fn phases(
        &self,
        math: impl Fn(&EquationSystem, f64) -> String,
    ) -> Vec<(&str, String, String)> {
        let phases = self.typeset.systems.iter().zip(self.equations.phases());
        let phases = phases.map(|(system, phase)| {
            let feet = words::feet(&phase.feet);
            (phase.name.as_str(), feet, math(system, self.width_em))
        });
        phases.collect()
    }
}

/// The text of a template, with one line end at its end.
pub fn rendered(template: &impl Template) -> askama::Result<String> {
    let mut text = template.render()?;
    text.truncate(text.trim_end().len());
    text.push('\n');
    Ok(text)
}
