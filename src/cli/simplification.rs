//! Simplification for the commands that offer it: the domain from files, the effect on rollouts.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::args::SimplifyArguments;
use super::output::{lines, names, read_for, read_text, spinner};
use crate::equations::Equations;
use crate::evaluate::Assessment;
use crate::files::EmittedFile;
use crate::model::ReducedModel;
use crate::recording::Recording;
use crate::sim::LatentSegment;
use crate::simplify::{
    Certificate, Domain, MARGIN, PrintedEquation, RolloutBasis, RolloutEffect, Samples,
    SimplifyError, Tolerance, bound_words, certificate_json, change_table, equation_table,
    lost_words, markdown, printed, rollout_table, rollouts_json, simplify,
};
use crate::typeset::{Cell, Rounding, Table, significant};
use crate::{Error, artifact};

/// Time between restarts of the short rollouts, as in the paper's second test.
pub(crate) const RESTART_S: f64 = 0.1;

struct Basis {
    domain: Domain,
    samples: Option<Samples>,
    recordings: Vec<Recording>,
    latent: Vec<LatentSegment>,
    /// `None` if the ranges were given.
    margin: Option<f64>,
}

impl Basis {
    /// The domain that the files of the arguments give: one TOML file of ranges, or the box around all samples of
    /// recordings.
    fn read(model: &ReducedModel, arguments: &SimplifyArguments) -> Result<Self, Error> {
        let files = &arguments.domain;
        let is_table = |path: &&PathBuf| path.extension().is_some_and(|end| end == "toml");
        if let Some(path) = files.iter().find(is_table) {
            if files.len() > 1 {
                let message = "one .toml file of ranges, or recordings, but not both".to_owned();
                let path = path.clone();
                return Err(SimplifyError::DomainFile { path, message }.into());
            }
            if arguments.margin.is_some() {
                return Err(SimplifyError::Margin.into());
            }
            return Ok(Self {
                domain: Domain::from_toml(model, path, &read_text(path)?)?,
                samples: None,
                recordings: Vec::new(),
                latent: Vec::new(),
                margin: None,
            });
        }
        let recordings = read_for(model, files, &arguments.reading)?;
        if model.encoder_map().is_err() {
            let model = model.name().to_owned();
            return Err(SimplifyError::NoEncoder { model }.into());
        }
        let segments = recordings.iter().flat_map(|recording| &recording.segments);
        let latent = segments.map(|segment| LatentSegment::encode(model, segment));
        let latent = latent.collect::<Result<Vec<_>, _>>()?;
        let samples = Samples::of(model, &latent.iter().collect::<Vec<_>>());
        let margin = arguments.margin.unwrap_or(MARGIN);
        Ok(Self {
            domain: Domain::around(model, &samples, margin)?,
            samples: Some(samples),
            recordings,
            latent,
            margin: Some(margin),
        })
    }

    /// The effect of simplification on rollouts; none without recordings or decoder.
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

pub(crate) struct Outcome {
    pub model: ReducedModel,
    original: ReducedModel,
    certificate: Certificate,
    rollouts: Option<RolloutEffect>,
    basis: Basis,
    domain_files: Vec<String>,
}

/// Simplifies a model as typed; nothing if no domain was given.
pub(crate) fn run(
    equations: &Equations<'_>,
    arguments: &SimplifyArguments,
) -> Result<Option<Outcome>, Error> {
    let model = equations.model();
    if arguments.domain.is_empty() {
        return Ok(None);
    }
    let progress = spinner("simplifying");
    let basis = Basis::read(model, arguments)?;
    let tolerance = arguments.tolerance.unwrap_or(Tolerance::Absolute(0.0));
    let simplified = simplify(equations, &basis.domain, basis.samples.as_ref(), tolerance)?;
    progress.set_message("rolling out");
    let rollouts = basis.rollouts(model, &simplified.model)?;
    progress.finish_and_clear();
    let mut outcome = Outcome {
        model: simplified.model,
        original: model.clone(),
        certificate: simplified.certificate,
        rollouts,
        basis,
        domain_files: names(&arguments.domain),
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
            entry.insert("margin".to_owned(), json!(self.basis.margin));
            let builder = self.model.clone().into_builder();
            self.model = builder.provenance(provenance).build()?;
        }
        Ok(())
    }

    /// How coefficients are printed unless digits are given: in full if simplification has already
    /// chosen their digits.
    pub(crate) fn rounding(&self) -> Rounding {
        match self.certificate.n_changes() {
            0 => Rounding::default(),
            _ => Rounding::Exact,
        }
    }

    /// Adds the certificate to the emitted files and, if anything changed, a comment to those that can hold one; its
    /// summary, and the same as JSON. `equations` are those of the model as they are printed, `rounding` is how.
    pub(crate) fn add_to(
        &self,
        files: &mut Vec<EmittedFile>,
        equations: &Equations<'_>,
        rounding: Rounding,
    ) -> Result<(String, Value), Error> {
        let basis = &self.basis;
        let printed = match rounding {
            Rounding::Exact => Vec::new(),
            _ => printed(equations, &basis.domain, basis.samples.as_ref(), rounding)?,
        };
        let name = format!("{}-simplification.md", self.model.identifier());
        let (models, rollouts) = ([&self.original, &self.model], self.rollouts.as_ref());
        let page = markdown(models, &self.certificate, rollouts, &printed);
        let mut value = certificate_json(&self.certificate);
        value["file"] = json!(name);
        value["domain_files"] = json!(self.domain_files);
        value["margin"] = json!(basis.margin);
        value["rollouts"] = json!(rollouts.map(rollouts_json));
        value["printed"] = printed.iter().map(printed_json).collect();
        if self.certificate.n_changes() > 0 {
            self.comment(files, &name);
        }
        files.push(EmittedFile::new(name, page));
        Ok((self.summary(), value))
    }

    /// Adds a comment to each file of equations or code that names the model it was simplified from.
    fn comment(&self, files: &mut [EmittedFile], certificate_file: &str) {
        let lines = [
            format!("Simplified within {}", self.certificate.tolerance.words()),
            format!(
                "from the model with digest {}; {certificate_file} bounds each change.",
                artifact::digest(&self.original).short()
            ),
        ];
        for file in files {
            let Some([before, after]) = comment_marks(Path::new(&file.path)) else {
                continue;
            };
            let comment = lines
                .each_ref()
                .map(|line| format!("{before}{line}{after}\n"));
            let after_first_line = file.contents.find('\n').map_or(0, |end| end + 1);
            file.contents
                .insert_str(after_first_line, &comment.concat());
        }
    }

    fn summary(&self) -> String {
        let (terms, digits) = (self.certificate.terms(), self.certificate.digits());
        let operations = self.certificate.operations();
        let mut text = format!(
            "simplified within {}:\n{terms} active terms, {digits} digits, {operations} operations of ddz\n\n{}",
            self.certificate.tolerance.words(),
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

/// Delimiters of a comment in a file of this kind; `None` for files without the model's equations.
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
pub(crate) fn exact_words(equations: &Equations<'_>) -> String {
    match equations.steps() {
        [] => String::new(),
        steps => format!("simplified exactly:\n{}\n", lines("  ", steps)),
    }
}

fn printed_json(equation: &PrintedEquation) -> Value {
    json!({
        "phase": equation.phase,
        "equation": format!("ddz{}", equation.output + 1),
        "bound": equation.bound.map(|bound| [bound.lo(), bound.hi()]),
        "measured_max": equation.measured.map(|measured| measured.max),
    })
}

const LADDER: [f64; 4] = [0.001, 0.01, 0.05, 0.1];

/// Simplifies a model within several tolerances over the recordings of an assessment: a table with a row per tolerance
/// (size, error and rollouts of the simplified equations), one of the errors of each equation within `chosen`, and one
/// of every change within it.
pub(crate) fn ladder(
    model: &ReducedModel,
    assessment: &Assessment<'_>,
    chosen: Tolerance,
) -> Result<[Table; 3], Error> {
    let latent: Vec<&LatentSegment> = assessment.runs.iter().map(|run| &run.latent).collect();
    let samples = Samples::of(model, &latent);
    let domain = Domain::around(model, &samples, MARGIN)?;
    let basis = RolloutBasis {
        domain: &domain,
        segments: assessment.runs.iter().map(|run| run.segment).collect(),
        latent,
        restart_every_s: assessment.restart_every_s,
    };
    let rms = |sums, name| assessment.fit(sums, name).map(|fit| fit.rms);
    let (whole, short) = (&assessment.full, &assessment.restarted);
    let [x, z] = ["body.x", "body.z"].map(|name| [rms(whole, name), rms(short, name)]);
    let equations = &Equations::of(model);
    let none = simplify(equations, &domain, Some(&samples), Tolerance::Absolute(0.0))?;
    let mut steps = vec![("none".to_owned(), none.certificate, [x, z])];
    let names = assessment.names.iter();
    let body = names.filter(|name| name.starts_with("body."));
    let places = ["body.x", "body.z"].map(|name| body.clone().position(|known| known == name));
    for share in LADDER {
        let tolerance = Tolerance::ShareOfRms(share);
        let made = simplify(equations, &domain, Some(&samples), tolerance)?;
        let errors = basis.errors(&made.model)?;
        let of = |place: Option<usize>| errors.rms.get(place?).copied();
        let body = places.map(|place| of(place).unwrap_or_default());
        steps.push((tolerance.to_string(), made.certificate, body));
    }
    let certificate = simplify(equations, &domain, Some(&samples), chosen)?.certificate;
    Ok([
        ladder_table(&steps, assessment.restart_every_s),
        equation_table(&certificate),
        change_table(&certificate),
    ])
}

/// A tolerance, its certificate, and root mean square errors of body x and z, whole and restarted.
type Step = (String, Certificate, [[Option<f64>; 2]; 2]);

fn ladder_table(steps: &[Step], restart_every_s: f64) -> Table {
    let every = format!("every {restart_every_s} s: body.x");
    let percent = |share: Option<f64>, text: fn(f64) -> String| -> Cell {
        let text = share.map(|share| format!("{}\u{a0}%", text(100.0 * share)));
        text.into()
    };
    Table::of(steps)
        .column("tolerance", "", |(name, ..)| name)
        .column("terms", "", |(_, made, _)| made.terms().after)
        .column("digits", "", |(_, made, _)| made.digits().after)
        .column("operations", "", |(_, made, _)| made.operations().after)
        .column("certified error", "", |(_, made, _)| {
            percent(made.largest_bound_share(), bound_words)
        })
        .column("measured max", "", |(_, made, _)| {
            percent(made.largest_measured_share(), significant)
        })
        .column("measured rms", "", |(_, made, _)| {
            percent(made.largest_rms_share(), significant)
        })
        .column("body.x", "m", |(.., [x, _])| x[0])
        .column("body.z", "m", |(.., [_, z])| z[0])
        .column(&every, "m", |(.., [x, _])| x[1])
        .column("body.z", "m", |(.., [_, z])| z[1])
        .table()
}
