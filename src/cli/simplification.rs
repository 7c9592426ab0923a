//! Simplification for the commands that offer it: the domain from files, the effect on rollouts.

use indicatif::ProgressBar;

use super::*;
use crate::sim::LatentSegment;

pub(super) const RESTART_S: f64 = 0.1;

pub(super) struct Outcome {
    pub model: ReducedModel,
    original: ReducedModel,
    certificate: Certificate,
    rollouts: Option<RolloutEffect>,
    domain: Domain,
    samples: Option<Samples>,
    /// `None` if the ranges were given.
    margin: Option<f64>,
    domain_files: Vec<String>,
}

/// `None` if no domain was given.
pub(super) fn run(
    equations: &Equations<'_>,
    arguments: &SimplifyArguments,
) -> Result<Option<Outcome>> {
    let (original, files) = (&*equations.model, &arguments.domain);
    if files.is_empty() {
        return Ok(None);
    }
    let progress = progress_bar("simplifying", 2); // and rollouts, which need as much time
    let mut recordings = Vec::new();
    let ranges = ranges(original, arguments)?;
    if ranges.is_none() {
        recordings = read_for(original, files, &arguments.reading)?;
        if original.encoder_map().is_err() {
            let model = original.name().to_owned();
            return Err(SimplifyError::NoEncoder { model }.into());
        }
    }
    let segments: Vec<&Segment> = recordings.iter().flat_map(|r| &r.segments).collect();
    let latent = segments.iter().map(|s| LatentSegment::encode(original, s));
    let latent = latent.collect::<Result<Vec<_>, _>>()?;
    let latent: Vec<&LatentSegment> = latent.iter().collect();
    let (domain, samples, margin) = match ranges {
        Some(domain) => (domain, None, None),
        None => {
            let samples = Samples::of(original, &latent);
            let margin = arguments.margin.unwrap_or(MARGIN);
            let domain = Domain::around(original, &samples, margin)?;
            (domain, Some(samples), Some(margin))
        }
    };
    let tolerance = arguments.tolerance.unwrap_or(Tolerance::Absolute(0.0));
    let made = simplify(equations, &domain, samples.as_ref(), tolerance)?;
    progress.inc(1);
    progress.set_message("rolling out");
    let basis = RolloutBasis {
        domain: &domain,
        segments,
        latent,
        restart_every_s: RESTART_S,
    };
    let can_roll_out = !recordings.is_empty() && original.decoder_map().is_ok();
    let rollouts = can_roll_out.then(|| basis.effect(original, &made.model));
    let rollouts = rollouts.transpose()?;
    progress.finish_and_clear();
    let mut outcome = Outcome {
        model: made.model,
        original: original.clone(),
        certificate: made.certificate,
        rollouts,
        domain,
        samples,
        margin,
        domain_files: names(files),
    };
    outcome.record_domain()?;
    Ok(Some(outcome))
}

fn ranges(model: &ReducedModel, arguments: &SimplifyArguments) -> Result<Option<Domain>> {
    let is_table = |path: &&PathBuf| path.extension().is_some_and(|end| end == "toml");
    let Some(path) = arguments.domain.iter().find(is_table) else {
        return Ok(None);
    };
    if arguments.domain.len() > 1 {
        let message = "one .toml file of ranges, or recordings, but not both".to_owned();
        let path = path.clone();
        return Err(SimplifyError::DomainFile { path, message }.into());
    }
    if arguments.margin.is_some() {
        return Err(SimplifyError::Margin.into());
    }
    Ok(Some(Domain::from_toml(model, path, &read_text(path)?)?))
}

impl Outcome {
    fn record_domain(&mut self) -> Result<()> {
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

    /// All digits if simplification has already chosen the digits of the coefficients.
    pub(super) fn rounding(&self) -> Option<Rounding> {
        (self.certificate.n_changes() > 0).then_some(Rounding::Exact)
    }

    /// Adds the certificate, and a comment to files that can contain one; `equations` are as printed.
    pub(super) fn add_to(
        &self,
        files: &mut Vec<EmittedFile>,
        equations: &Equations<'_>,
        rounding: Rounding,
    ) -> Result<(String, Value)> {
        let printed = match rounding {
            Rounding::Exact => Vec::new(),
            _ => printed(equations, &self.domain, self.samples.as_ref(), rounding)?,
        };
        let name = format!("{}-simplification.md", self.model.identifier());
        let (models, rollouts) = ([&self.original, &self.model], self.rollouts.as_ref());
        let page = markdown(models, &self.certificate, rollouts, &printed);
        let mut value = certificate_json(&self.certificate);
        let printed = printed.iter().map(|equation| {
            json!({
                "phase": equation.phase,
                "equation": format!("ddz{}", equation.output + 1),
                "bound": equation.bound.map(|bound| [bound.lo(), bound.hi()]),
                "measured_max": equation.measured.map(|measured| measured.max),
            })
        });
        let more = json!({
            "file": name,
            "domain_files": self.domain_files,
            "margin": self.margin,
            "rollouts": rollouts.map(rollouts_json),
            "printed": printed.collect::<Vec<_>>(),
        });
        extend(&mut value, more);
        if self.certificate.n_changes() > 0 {
            self.comment(files, &name);
        }
        files.push(EmittedFile::new(name, page));
        Ok((self.summary(), value))
    }

    fn comment(&self, files: &mut [EmittedFile], certificate_file: &str) {
        let within = self.certificate.tolerance.words();
        let digest = artifact::digest(&self.original).short();
        for file in files {
            let [before, after] = match Path::new(&file.path).extension().and_then(|e| e.to_str()) {
                Some("tex" | "m") => ["% ", ""],
                Some("c" | "h") => ["/* ", " */"],
                Some("rs") => ["// ", ""],
                Some("py") => ["# ", ""],
                Some("md" | "html") => ["<!-- ", " -->"],
                _ => continue, // contains none of the model's equations
            };
            let comment = format!(
                "{before}Simplified within {within}{after}\n\
                 {before}from the model with digest {digest}; {certificate_file} bounds each change.{after}\n"
            );
            let after_first_line = file.contents.find('\n').map_or(0, |end| end + 1);
            file.contents.insert_str(after_first_line, &comment);
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
        let lost = lost_words(&self.certificate).into_iter();
        text.extend(lost.map(|sentence| format!("\n{sentence}.\n")));
        let rollouts = self.rollouts.iter();
        text.extend(rollouts.map(|effect| format!("\n{}", rollout_table(effect))));
        text + "\n"
    }
}

pub(super) fn exact_words(equations: &Equations<'_>) -> String {
    match equations.steps.as_slice() {
        [] => String::new(),
        steps => format!("simplified exactly:\n{}\n", lines("  ", steps)),
    }
}

const LADDER: [f64; 4] = [0.001, 0.01, 0.05, 0.1];
/// Its progress steps, including one without tolerance and one with the chosen tolerance.
pub(super) const LADDER_STEPS: usize = LADDER.len() + 2;

/// Sizes, errors and rollouts for several tolerances; errors of each equation and changes for `chosen`.
pub(super) fn ladder(
    model: &ReducedModel,
    assessment: &Assessment<'_>,
    chosen: Tolerance,
    progress: &ProgressBar,
) -> Result<[Table; 3]> {
    let latent: Vec<&LatentSegment> = assessment.runs.iter().map(|run| &run.latent).collect();
    let samples = Samples::of(model, &latent);
    let domain = Domain::around(model, &samples, MARGIN)?;
    let basis = RolloutBasis {
        domain: &domain,
        segments: assessment.runs.iter().map(|run| &*run.segment).collect(),
        latent,
        restart_every_s: assessment.restart_every_s,
    };
    let equations = &Equations::of(model);
    let within = |tolerance| {
        let made = simplify(equations, &domain, Some(&samples), tolerance);
        progress.inc(1);
        made
    };
    let [whole, short] =
        [&assessment.full, &assessment.restarted].map(|sums| body_rms(assessment, sums));
    let unchanged = [0, 1].map(|axis| [whole[axis], short[axis]]);
    let none = within(Tolerance::Absolute(0.0))?.certificate;
    let mut steps = vec![("none".to_owned(), none, unchanged)];
    let names = assessment.names.iter();
    let body = names.filter(|name| name.starts_with("body."));
    let places = ["body.x", "body.z"].map(|name| body.clone().position(|known| known == name));
    for tolerance in LADDER.map(Tolerance::ShareOfRms) {
        let made = within(tolerance)?;
        let rms = basis.errors(&made.model)?.rms;
        let body = places.map(|place| place.and_then(|place| rms.get(place).copied()));
        let body = body.map(Option::unwrap_or_default);
        steps.push((tolerance.to_string(), made.certificate, body));
    }
    let certificate = within(chosen)?.certificate;
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
    let certified = |made: &Certificate| percent(made.largest_bound_share(), bound_words);
    let measured = |share: Option<f64>| percent(share, significant);
    Table::of(steps)
        .column("tolerance", "", |(name, ..)| name)
        .column("terms", "", |(_, made, _)| made.terms().after)
        .column("digits", "", |(_, made, _)| made.digits().after)
        .column("operations", "", |(_, made, _)| made.operations().after)
        .column("certified error", "", |(_, made, _)| certified(made))
        .column("measured max", "", |(_, made, _)| {
            measured(made.largest_measured_share())
        })
        .column("measured rms", "", |(_, made, _)| {
            measured(made.largest_share(|of| Some(of.measured?.rms)))
        })
        .column("body.x", "m", |(.., [x, _])| x[0])
        .column("body.z", "m", |(.., [_, z])| z[0])
        .column(&every, "m", |(.., [x, _])| x[1])
        .column("body.z", "m", |(.., [_, z])| z[1])
        .table()
}
