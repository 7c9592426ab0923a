//! The settings of `romc train`: from flags to options, and back to flags for the provenance.

use std::fmt::{Display, Write as _};

use super::args::{PhaseSet, TrainArguments, TrainSettings};
use crate::model::StandardLibrary;
use crate::recording::PhaseRule;
use crate::train::{LibraryChoice, TrainOptions};

/// The options that the flags describe.
pub(super) fn options(arguments: &TrainArguments, name: String) -> TrainOptions {
    let settings = &arguments.settings;
    let mut options = match settings.paper {
        true => TrainOptions::paper(name, arguments.latent_dim),
        false => TrainOptions::new(name, arguments.latent_dim),
    };
    set(&mut options.seed, settings.seed);
    set(&mut options.joint.seeds, settings.seeds);
    set(&mut options.joint.schedule.epochs, settings.epochs);
    set(&mut options.encoder.lift_weight, settings.lift_weight);
    set(&mut options.encoder.body_weight, settings.body_weight);
    set(&mut options.regression.slack, settings.slack);
    options.library = library(settings, options.library);
    if settings.phases == Some(PhaseSet::ContactRearFlight) {
        options.phases = PhaseRule::three_phase().with_min_samples(options.phases.min_samples);
    }
    options
}

fn library(settings: &TrainSettings, default: LibraryChoice) -> LibraryChoice {
    match (&settings.terms, default) {
        (Some(terms), _) => LibraryChoice::Terms(
            terms
                .split(';')
                .map(|term| term.trim().to_owned())
                .collect(),
        ),
        (None, LibraryChoice::Standard(standard)) => LibraryChoice::Standard(StandardLibrary {
            degree: settings.degree.unwrap_or(standard.degree),
            trigonometric: settings.trigonometric || standard.trigonometric,
            inputs: standard.inputs,
        }),
        (None, terms @ LibraryChoice::Terms(_)) => terms,
    }
}

fn set<T>(option: &mut T, given: Option<T>) {
    if let Some(value) = given {
        *option = value;
    }
}

/// The flags that were given, with a space before each.
pub(super) fn as_flags(settings: &TrainSettings) -> String {
    let mut line = String::new();
    let mut flag = |name: &str, value: Option<&dyn Display>| {
        if let Some(value) = value {
            let _ = write!(line, " --{name} {value}");
        }
    };
    let shown = |value: &Option<f64>| value.map(|value| value.to_string());
    flag("seed", settings.seed.as_ref().map(|v| v as &dyn Display));
    flag("seeds", settings.seeds.as_ref().map(|v| v as &dyn Display));
    flag(
        "epochs",
        settings.epochs.as_ref().map(|v| v as &dyn Display),
    );
    flag(
        "lift-weight",
        shown(&settings.lift_weight)
            .as_ref()
            .map(|v| v as &dyn Display),
    );
    flag(
        "body-weight",
        shown(&settings.body_weight)
            .as_ref()
            .map(|v| v as &dyn Display),
    );
    flag(
        "slack",
        shown(&settings.slack).as_ref().map(|v| v as &dyn Display),
    );
    flag(
        "degree",
        settings.degree.as_ref().map(|v| v as &dyn Display),
    );
    if let Some(terms) = &settings.terms {
        flag("terms", Some(&format!("\"{terms}\"")));
    }
    match settings.phases {
        Some(PhaseSet::ContactFlight) => flag("phases", Some(&"contact-flight")),
        Some(PhaseSet::ContactRearFlight) => flag("phases", Some(&"contact-rear-flight")),
        None => {}
    }
    let switches = [
        ("paper", settings.paper),
        ("trigonometric", settings.trigonometric),
    ];
    for (name, _) in switches.into_iter().filter(|(_, given)| *given) {
        let _ = write!(line, " --{name}");
    }
    line
}
