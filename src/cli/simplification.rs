//! Simplification for the commands that offer it: the domain from files, the effect on rollouts.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::args::SimplifyArguments;
use super::output::{Table, read_recordings, significant, spinner};
use crate::equations::{Equations, ExactStep};
use crate::evaluate::Assessment;
use crate::files::EmittedFile;
use crate::model::ReducedModel;
use crate::recording::Recording;
use crate::sim::LatentSegment;
use crate::simplify::{
    Certificate, Domain, MARGIN, PrintedEquation, RolloutBasis, RolloutEffect, Samples, Simplified,
    SimplifyError, Tolerance, bound_words, certificate_json, change_words, interval_words,
    lost_words, markdown, printed, rollouts_json, simplify,
};
use crate::typeset::Rounding;
use crate::{Error, artifact};

/// Time between restarts of the short rollouts, as in the paper's second test.
const RESTART_S: f64 = 0.1;

/// A domain with the samples that it was made from.
pub struct Basis {
    domain: Domain,
    samples: Option<Samples>,
    recordings: Vec<Recording>,
    latent: Vec<LatentSegment>,
}

impl Basis {
    /// The domain that `files` give: one TOML file of ranges, or recordings.
    ///
    /// # Errors
    /// [`Error::Simplify`] for files that give no domain, and whatever reading refuses.
    pub fn read(
        model: &ReducedModel,
        files: &[PathBuf],
        margin: Option<f64>,
    ) -> Result<Self, Error> {
        let is_table = |path: &&PathBuf| path.extension().is_some_and(|end| end == "toml");
        match files.iter().find(is_table) {
            None => Self::of(model, read_recordings(files)?, margin.unwrap_or(MARGIN)),
            Some(path) if files.len() > 1 => Err(SimplifyError::DomainFile {
                path: path.clone(),
                message: "one .toml file of ranges, or recordings, but not both".to_owned(),
            }
            .into()),
            Some(_) if margin.is_some() => Err(SimplifyError::Margin.into()),
            Some(path) => {
                let text = fs::read_to_string(path).map_err(|source| Error::Read {
                    path: path.clone(),
                    source,
                })?;
                Ok(Self {
                    domain: Domain::from_toml(model, path, &text)?,
                    samples: None,
                    recordings: Vec::new(),
                    latent: Vec::new(),
                })
            }
        }
    }

    /// The box around all samples of `recordings`.
    fn of(model: &ReducedModel, recordings: Vec<Recording>, margin: f64) -> Result<Self, Error> {
        if model.encoder_map().is_err() {
            return Err(SimplifyError::NoEncoder {
                model: model.name().to_owned(),
            }
            .into());
        }
        let latent = (recordings.iter())
            .flat_map(|recording| &recording.segments)
            .map(|segment| LatentSegment::encode(model, segment))
            .collect::<Result<Vec<_>, _>>()?;
        let samples = Samples::of(model, &latent.iter().collect::<Vec<_>>());
        Ok(Self {
            domain: Domain::around(model, &samples, margin)?,
            samples: Some(samples),
            recordings,
            latent,
        })
    }

    /// What simplification does to rollouts; nothing without recordings or decoder.
    fn rollouts(
        &self,
        model: &ReducedModel,
        simplified: &ReducedModel,
    ) -> Result<Option<RolloutEffect>, Error> {
        if self.recordings.is_empty() || model.decoder_map().is_err() {
            return Ok(None);
        }
        let recordings = self.recordings.iter();
        let basis = RolloutBasis {
            domain: &self.domain,
            segments: recordings.flat_map(|r| &r.segments).collect(),
            latent: self.latent.iter().collect(),
            restart_every_s: RESTART_S,
        };
        Ok(Some(basis.effect(model, simplified)?))
    }
}

/// A simplified model and all that is told about it.
pub struct Outcome {
    /// The model.
    pub model: ReducedModel,
    original: ReducedModel,
    certificate: Certificate,
    rollouts: Option<RolloutEffect>,
    basis: Basis,
    domain_files: Vec<String>,
    /// `None` if the ranges were given.
    margin: Option<f64>,
}

/// Simplifies a model as typed; nothing if no domain was given.
///
/// # Errors
/// Whatever reading, simplifying or simulating refuses.
pub fn run(
    equations: &Equations<'_>,
    arguments: &SimplifyArguments,
) -> Result<Option<Outcome>, Error> {
    let model = equations.model();
    if arguments.domain.is_empty() {
        return Ok(None);
    }
    let progress = spinner("simplifying");
    let basis = Basis::read(model, &arguments.domain, arguments.margin)?;
    let tolerance = arguments.tolerance.unwrap_or(Tolerance::Absolute(0.0));
    let Simplified {
        model: simplified,
        certificate,
    } = simplify(equations, &basis.domain, basis.samples.as_ref(), tolerance)?;
    progress.set_message("rolling out");
    let rollouts = basis.rollouts(model, &simplified)?;
    progress.finish_and_clear();
    let margin = (basis.samples.as_ref()).map(|_| arguments.margin.unwrap_or(MARGIN));
    let mut outcome = Outcome {
        model: simplified,
        original: model.clone(),
        certificate,
        rollouts,
        basis,
        domain_files: arguments
            .domain
            .iter()
            .map(|path| path.display().to_string())
            .collect(),
        margin,
    };
    outcome.record_domain()?;
    Ok(Some(outcome))
}

impl Outcome {
    /// Adds to the provenance of a changed model where the domain comes from.
    fn record_domain(&mut self) -> Result<(), Error> {
        let mut provenance = self.model.provenance().clone();
        if let Some(Value::Object(entry)) = provenance.get_mut("simplification")
            && self.certificate.n_changes() > 0
        {
            entry.insert("domain".to_owned(), json!(self.domain_files));
            entry.insert("margin".to_owned(), json!(self.margin));
            let builder = self.model.clone().into_builder();
            self.model = builder.provenance(provenance).build()?;
        }
        Ok(())
    }

    /// How coefficients are printed unless digits are given: in full if simplification has already
    /// chosen their digits.
    pub fn rounding(&self) -> Rounding {
        match self.certificate.n_changes() {
            0 => Rounding::default(),
            _ => Rounding::Exact,
        }
    }

    /// The certificate as a file beside the emitted ones, its summary, and the same as JSON;
    /// `rounding` is how coefficients are printed.
    ///
    /// # Errors
    /// [`Error::Simplify`] if printing cannot be evaluated.
    pub fn told(&self, rounding: Rounding) -> Result<(EmittedFile, String, Value), Error> {
        let basis = &self.basis;
        let printed = match rounding {
            Rounding::Exact => Vec::new(),
            _ => printed(&self.model, &basis.domain, basis.samples.as_ref(), rounding)?,
        };
        let name = format!("{}-simplification.md", self.model.identifier());
        let page = markdown(
            [&self.original, &self.model],
            &self.certificate,
            self.rollouts.as_ref(),
            &printed,
        );
        let mut value = certificate_json(&self.certificate);
        value["exact"] = (self.certificate.exact.iter()).map(exact_json).collect();
        value["file"] = json!(name);
        value["domain_files"] = json!(self.domain_files);
        value["margin"] = json!(self.margin);
        value["rollouts"] = json!(self.rollouts.as_ref().map(rollouts_json));
        value["printed"] = printed.iter().map(printed_json).collect();
        Ok((EmittedFile::new(name, page), self.summary(), value))
    }

    /// Tells in a comment of each file of equations or code what they were simplified from.
    pub fn comment(&self, files: &mut [EmittedFile]) {
        if self.certificate.n_changes() == 0 {
            return;
        }
        let lines = [
            format!(
                "Simplified within {}",
                tolerance_words(self.certificate.tolerance)
            ),
            format!(
                "from the model with digest {}; {}-simplification.md bounds each change.",
                artifact::digest(&self.original).short(),
                self.model.identifier()
            ),
        ];
        for file in files {
            let Some([before, after]) = comment_marks(Path::new(&file.path)) else {
                continue;
            };
            let comment: String = (lines.iter())
                .map(|line| format!("{before}{line}{after}\n"))
                .collect();
            let after_first_line = file.contents.find('\n').map_or(0, |end| end + 1);
            file.contents.insert_str(after_first_line, &comment);
        }
    }

    fn summary(&self) -> String {
        let ((before, after), (slow, fast)) =
            (self.certificate.terms(), self.certificate.operations());
        let (long, short) = self.certificate.digits();
        let mut text = format!(
            "simplified within {}:\n{before} to {after} active terms, {long} to {short} digits, {slow} to {fast} operations of ddz\n\n{}",
            tolerance_words(self.certificate.tolerance),
            equation_table(&self.certificate)
        );
        for sentence in lost_words(&self.certificate) {
            let _ = writeln!(text, "\n{sentence}.");
        }
        if let Some(effect) = &self.rollouts {
            let _ = write!(text, "\n{}", rollout_table(effect));
        }
        text + "\n"
    }
}

/// What stands around a comment in a file of this kind; nothing where the model's equations are not.
fn comment_marks(path: &Path) -> Option<[&'static str; 2]> {
    match path.extension()?.to_str()? {
        "tex" | "m" => Some(["% ", ""]),
        "c" | "h" => Some(["/* ", " */"]),
        "rs" => Some(["// ", ""]),
        "py" => Some(["# ", ""]),
        "md" | "html" => Some(["<!-- ", " -->"]),
        _ => None,
    }
}

/// What exact simplification did, one line for each step; nothing if it did nothing.
pub fn exact_words(equations: &Equations<'_>) -> String {
    let lines: String = (equations.steps().iter())
        .map(|step| format!("  {step}\n"))
        .collect();
    match lines.as_str() {
        "" => lines,
        _ => format!("simplified exactly:\n{lines}\n"),
    }
}

/// One step of exact simplification.
pub fn exact_json(step: &ExactStep) -> Value {
    json!({
        "phase": step.phase,
        "equation": format!("ddz{}", step.output + 1),
        "terms": { "before": step.before.len(), "after": step.after.len() },
        "before": ExactStep::sum_words(&step.before),
        "after": ExactStep::sum_words(&step.after),
    })
}

/// A tolerance with its unit.
pub fn tolerance_words(tolerance: Tolerance) -> String {
    match tolerance {
        Tolerance::ShareOfRms(_) => {
            format!("{tolerance} of the root mean square of each ddz over the recordings")
        }
        Tolerance::Absolute(_) => format!("{tolerance} scaled units per s^2"),
    }
}

fn equation_table(certificate: &Certificate) -> Table {
    let mut table = Table::new([
        "phase, equation",
        "terms",
        "rms of ddz",
        "allowed error",
        "certified error",
        "measured max",
        "measured rms",
    ]);
    for (phase, equation) in certificate.equations() {
        let measured = equation.measured;
        let cell = |value: Option<f64>| value.map_or("-".to_owned(), significant);
        table.row([
            format!("{phase}, ddz{}", equation.output + 1),
            format!("{} to {}", equation.terms_before, equation.terms_after),
            cell(equation.rms),
            significant(equation.allowed),
            bound_words(equation.bound.magnitude()),
            cell(measured.map(|measured| measured.max)),
            cell(measured.map(|measured| measured.rms)),
        ]);
    }
    table
}

fn rollout_table(effect: &RolloutEffect) -> Table {
    let every = format!("restarted every {} s, before", effect.restart_every_s);
    let mut table = Table::new(["rms error", "whole jump, before", "after", &every, "after"]);
    let cell = |value: Option<f64>| value.map_or("-".to_owned(), significant);
    for (k, name) in effect.names.iter().enumerate() {
        let (before, after) = (effect.before.rms[k], effect.after.rms[k]);
        table.row([
            format!("{name}, {}", effect.units[k]),
            cell(before[0]),
            cell(after[0]),
            cell(before[1]),
            cell(after[1]),
        ]);
    }
    table
}

fn printed_json(equation: &PrintedEquation) -> Value {
    json!({
        "phase": equation.phase,
        "equation": format!("ddz{}", equation.output + 1),
        "bound": equation.bound.map(|bound| [bound.lo(), bound.hi()]),
        "measured_max": equation.measured.map(|measured| measured.max),
    })
}

/// Tolerances that a report compares.
const LADDER: [f64; 4] = [0.001, 0.01, 0.05, 0.1];

/// What a report tells about simplification.
pub struct Ladder {
    /// A row a tolerance: what is left, how far it can be off, how far rollouts are.
    pub tolerances: Table,
    /// Errors of each equation at the chosen tolerance.
    pub equations: Table,
    /// Every change at the chosen tolerance.
    pub changes: Table,
}

/// Simplifies a model within several tolerances over the recordings of an assessment, and lists the
/// changes within `chosen`.
///
/// # Errors
/// Whatever simplifying or simulating refuses.
pub fn ladder(
    model: &ReducedModel,
    assessment: &Assessment<'_>,
    chosen: Tolerance,
) -> Result<Ladder, Error> {
    let latent: Vec<&LatentSegment> = assessment.runs.iter().map(|run| &run.latent).collect();
    let samples = Samples::of(model, &latent);
    let domain = Domain::around(model, &samples, MARGIN)?;
    let basis = RolloutBasis {
        domain: &domain,
        segments: assessment.runs.iter().map(|run| run.segment).collect(),
        latent,
        restart_every_s: assessment.restart_every_s,
    };
    let every = format!("every {} s: body.x, m", assessment.restart_every_s);
    let mut table = Table::new([
        "tolerance",
        "terms",
        "digits",
        "operations",
        "certified error",
        "measured max",
        "measured rms",
        "body.x, m",
        "body.z, m",
        &every,
        "body.z, m",
    ]);
    let names = ["body.x", "body.z"];
    let rms = |sums, name| assessment.fit(sums, name).map(|fit| fit.rms);
    let full = names.map(|name| rms(&assessment.full, name));
    let restarted = names.map(|name| rms(&assessment.restarted, name));
    let equations = &Equations::of(model);
    let none = simplify(equations, &domain, Some(&samples), Tolerance::Absolute(0.0))?.certificate;
    table.row(ladder_row(
        "none",
        &none,
        [full[0], full[1], restarted[0], restarted[1]],
    ));
    let places = names.map(|name| {
        let body = assessment
            .names
            .iter()
            .filter(|known| known.starts_with("body."));
        body.clone().position(|known| known == name)
    });
    for share in LADDER {
        let tolerance = Tolerance::ShareOfRms(share);
        let made = simplify(equations, &domain, Some(&samples), tolerance)?;
        let errors = basis.errors(&made.model)?;
        let of = |place: Option<usize>, kind: usize| errors.rms.get(place?)?[kind];
        let [x, z] = places;
        let body = [of(x, 0), of(z, 0), of(x, 1), of(z, 1)];
        table.row(ladder_row(&tolerance.to_string(), &made.certificate, body));
    }
    let certificate = simplify(equations, &domain, Some(&samples), chosen)?.certificate;
    Ok(Ladder {
        tolerances: table,
        equations: equation_table(&certificate),
        changes: change_table(&certificate),
    })
}

fn ladder_row(name: &str, certificate: &Certificate, body: [Option<f64>; 4]) -> Vec<String> {
    let percent = |share: Option<f64>| {
        share.map_or("-".to_owned(), |share| {
            format!("{}\u{a0}%", significant(100.0 * share))
        })
    };
    let mut row = vec![
        name.to_owned(),
        certificate.terms().1.to_string(),
        certificate.digits().1.to_string(),
        certificate.operations().1.to_string(),
        (certificate.largest_bound_share()).map_or("-".to_owned(), |share| {
            format!("{}\u{a0}%", bound_words(100.0 * share))
        }),
        percent(certificate.largest_measured_share()),
        percent(certificate.largest_rms_share()),
    ];
    row.extend(body.map(|rms| rms.map_or("-".to_owned(), significant)));
    row
}

fn change_table(certificate: &Certificate) -> Table {
    let mut table = Table::new([
        "phase, equation",
        "term",
        "change",
        "before",
        "after",
        "bound",
        "measured max",
        "measured rms",
    ]);
    for (phase, equation) in certificate.equations() {
        for change in &equation.changes {
            let cell = |value: Option<f64>| value.map_or("-".to_owned(), significant);
            table.row([
                format!("{phase}, ddz{}", equation.output + 1),
                change.term.clone(),
                change_words(change),
                change.before.to_string(),
                change.after.to_string(),
                interval_words(change.bound),
                cell(change.measured.map(|measured| measured.max)),
                cell(change.measured.map(|measured| measured.rms)),
            ]);
        }
    }
    table
}
