//! The settings of `romc train`: from flags and a file to options, and back to flags for the provenance.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use serde_json::Value;

use super::actuators;
use super::args::{
    AccelerationSource, BpttIntegrator, FilteredRows, HiddenActivation, PhaseSet, TrainArguments,
    TrainMethod, TrainSettings,
};
use crate::Error;
use crate::model::{Activation, StandardLibrary};
use crate::recording::smoothing::SavitzkyGolay;
use crate::recording::{
    Accelerations, ConditionOptions, ImplausibleSamples, PhaseRule, SmoothedRows,
};
use crate::train::{
    Integrator, LibraryChoice, MIN_SAMPLES, MapOptions, ScaleOptions, TrainError, TrainOptions,
};

/// The options that the settings describe.
///
/// # Errors
/// [`Error::Read`] and [`Error::Config`] for the file of the actuators.
pub(super) fn options(
    settings: &TrainSettings,
    latent_dim: usize,
    name: String,
) -> Result<TrainOptions, Error> {
    let mut options = match settings.paper {
        true => TrainOptions::paper(name, latent_dim),
        false => TrainOptions::new(name, latent_dim),
    };
    if method(settings) == TrainMethod::Joint && !settings.paper {
        options.n_seeds = 3;
    }
    set(&mut options.seed, settings.seed);
    set(&mut options.n_seeds, settings.seeds);
    set(&mut options.joint.schedule.epochs, settings.epochs);
    set(&mut options.joint.weights.bptt, settings.bptt_weight);
    set(&mut options.joint.unroll.window, settings.bptt_window);
    set(&mut options.joint.unroll.stride, settings.bptt_stride);
    set(&mut options.joint.unroll.decay, settings.bptt_decay);
    let integrator = settings.bptt_integrator.map(|integrator| match integrator {
        BpttIntegrator::Euler => Integrator::Euler,
        BpttIntegrator::Rk2 => Integrator::Rk2,
        BpttIntegrator::Rk4 => Integrator::Rk4,
    });
    set(&mut options.joint.unroll.integrator, integrator);
    options.joint.maps = maps(settings);
    set(&mut options.encoder.lift_weight, settings.lift_weight);
    set(&mut options.encoder.body_weight, settings.body_weight);
    set(&mut options.regression.slack, settings.slack);
    set(&mut options.regression.smoothing, settings.moving_average);
    set(&mut options.encoder.least_std, settings.mask_std);
    set(
        &mut options.encoder.least_input_share,
        settings.mask_input_share,
    );
    options.encoder.rotate &= !settings.no_rotation;
    set(&mut options.wrench_frame, settings.wrench_frame);
    if !settings.paper {
        options.scaling = ScaleOptions::in_frame(options.wrench_frame);
    }
    set(&mut options.scaling.state, settings.state_scaling);
    set(&mut options.scaling.torque, settings.torque_scaling);
    set(&mut options.scaling.force, settings.force_scaling);
    set(&mut options.scaling.moment, settings.moment_scaling);
    options.library = library(settings, options.library);
    if settings.phases == Some(PhaseSet::ContactRearFlight) {
        options.phases = PhaseRule::three_phase().with_min_samples(options.phases.min_samples);
    }
    options.actuators = match settings.actuators.as_deref() {
        None | Some(actuators::NONE) => None,
        Some(path) => Some(actuators::read(Path::new(path))?),
    };
    Ok(options)
}

/// What happens to recordings before they are learned from.
///
/// # Errors
/// [`TrainError::Recording`] for a filter that does not exist.
pub(super) fn conditioning(settings: &TrainSettings) -> Result<ConditionOptions, TrainError> {
    let rows = match settings.smooth_rows {
        Some(FilteredRows::All) => SmoothedRows::All,
        Some(FilteredRows::Accelerations) | None => SmoothedRows::Accelerations,
    };
    let filter = settings
        .smooth
        .map(|shape| SavitzkyGolay::new(shape.window, shape.order))
        .transpose()?;
    Ok(ConditionOptions {
        implausible: match settings.leave_out_implausible {
            true => ImplausibleSamples::LeaveOut,
            false => ImplausibleSamples::Keep,
        },
        least_samples: MIN_SAMPLES,
        accelerations: match settings.accelerations {
            Some(AccelerationSource::Differences) => Accelerations::Differences,
            Some(AccelerationSource::Recorded) | None => Accelerations::Recorded,
        },
        smoothing: filter.map(|filter| (filter, rows)),
    })
}

/// The layers of encoder and decoder; the decoder mirrors the encoder unless it is described itself.
fn maps(settings: &TrainSettings) -> MapOptions {
    let encoder_layers: Vec<usize> = match &settings.encoder_layers {
        Some(widths) => widths.0.clone(),
        None => Vec::new(),
    };
    let decoder_layers = match &settings.decoder_layers {
        Some(widths) => widths.0.clone(),
        None => encoder_layers.iter().rev().copied().collect(),
    };
    MapOptions {
        encoder_layers,
        decoder_layers,
        activation: match settings.activation {
            Some(HiddenActivation::Elu) | None => Activation::Elu,
            Some(HiddenActivation::Tanh) => Activation::Tanh,
            Some(HiddenActivation::Sigmoid) => Activation::Sigmoid,
        },
    }
}

/// The method that is asked for; hidden layers are learned by the joint one only.
pub(super) fn method(settings: &TrainSettings) -> TrainMethod {
    let default = match maps(settings).is_linear() {
        true => TrainMethod::ClosedForm,
        false => TrainMethod::Joint,
    };
    settings.method.unwrap_or(default)
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
    let Ok(Value::Object(given)) = serde_json::to_value(settings) else {
        unreachable!("settings are a struct of numbers, texts and switches");
    };
    let mut line = String::new();
    for (name, value) in given {
        let written = match value {
            Value::Bool(true) => write!(line, " --{name}"),
            Value::Number(number) => match number.as_u64() {
                Some(count) => write!(line, " --{name} {count}"),
                None => write!(line, " --{name} {}", number.as_f64().unwrap_or(f64::NAN)),
            },
            Value::String(text) if text.contains(' ') => write!(line, " --{name} \"{text}\""),
            Value::String(text) => write!(line, " --{name} {text}"),
            Value::Array(widths) if widths.is_empty() => write!(line, " --{name} linear"),
            Value::Array(widths) => {
                let widths: Vec<String> = widths.iter().map(Value::to_string).collect();
                write!(line, " --{name} {}", widths.join(","))
            }
            Value::Null | Value::Bool(false) | Value::Object(_) => Ok(()),
        };
        written.expect("writing to a string cannot fail");
    }
    line
}

/// The settings of the command line over those of its file, if it names one.
///
/// # Errors
/// [`Error::Read`] and [`Error::Config`] for the file.
pub(super) fn effective(arguments: &TrainArguments) -> Result<TrainSettings, Error> {
    let given = &arguments.settings;
    let Some(path) = &arguments.config else {
        check_pairs(given)?;
        return Ok(given.clone());
    };
    let settings = overlay(given, read(path)?);
    check_pairs(&settings)?;
    if settings.latent_dim.is_none() {
        return Err(refused(
            path,
            "`latent-dim` is missing, here and on the command line",
        ));
    }
    Ok(settings)
}

/// An activation is of hidden layers only, rows to filter of a filter.
fn check_pairs(settings: &TrainSettings) -> Result<(), Error> {
    let refused = |option, found, expected| {
        Err(Error::Train(TrainError::Option {
            option,
            found,
            expected,
        }))
    };
    if let (Some(activation), true) = (settings.activation, maps(settings).is_linear()) {
        return refused(
            "activation",
            format!("{activation:?} without hidden layers"),
            "`--encoder-layers` or `--decoder-layers` beside it",
        );
    }
    if let (Some(rows), None) = (settings.smooth_rows, settings.smooth) {
        return refused(
            "smooth-rows",
            format!("{rows:?} without a filter"),
            "`--smooth` beside it",
        );
    }
    Ok(())
}

/// The settings of a file.
///
/// # Errors
/// [`Error::Read`] and [`Error::Config`].
pub(super) fn read(path: &Path) -> Result<TrainSettings, Error> {
    let text = fs::read_to_string(path).map_err(|source| Error::Read {
        path: path.to_owned(),
        source,
    })?;
    let settings =
        toml::from_str(&text).map_err(|error| refused(path, error.to_string().trim_end()))?;
    check(&settings).map_err(|message| refused(path, &message))?;
    Ok(settings)
}

/// A file of settings that cannot be used.
pub(super) fn refused(path: &Path, message: &str) -> Error {
    Error::Config {
        path: path.to_owned(),
        message: message.to_owned(),
    }
}

/// What clap checks of flags, for settings that came from a file.
fn check(settings: &TrainSettings) -> Result<(), String> {
    let counts = [
        ("latent-dim", settings.latent_dim),
        ("seeds", settings.seeds),
        ("epochs", settings.epochs),
        ("bptt-window", settings.bptt_window),
        ("bptt-stride", settings.bptt_stride),
        ("moving-average", settings.moving_average),
    ];
    if let Some((name, _)) = counts.iter().find(|(_, count)| *count == Some(0)) {
        return Err(format!("`{name}` is 0, expected at least 1"));
    }
    let layers = [
        ("encoder-layers", &settings.encoder_layers),
        ("decoder-layers", &settings.decoder_layers),
    ];
    for (name, widths) in layers {
        if widths.as_ref().is_some_and(|widths| widths.0.contains(&0)) {
            return Err(format!("`{name}` has a 0, expected widths of at least 1"));
        }
    }
    if settings.terms.is_some() && (settings.degree.is_some() || settings.trigonometric) {
        return Err(
            "`terms` stands beside `degree` or `trigonometric`, expected one or the other"
                .to_owned(),
        );
    }
    Ok(())
}

/// Every setting from `above` where it is given there, else from `below`.
fn overlay(above: &TrainSettings, below: TrainSettings) -> TrainSettings {
    let above = above.clone();
    TrainSettings {
        latent_dim: above.latent_dim.or(below.latent_dim),
        method: above.method.or(below.method),
        robot: above.robot.or(below.robot),
        paper: above.paper || below.paper,
        seed: above.seed.or(below.seed),
        seeds: above.seeds.or(below.seeds),
        epochs: above.epochs.or(below.epochs),
        encoder_layers: above.encoder_layers.or(below.encoder_layers),
        decoder_layers: above.decoder_layers.or(below.decoder_layers),
        activation: above.activation.or(below.activation),
        lift_weight: above.lift_weight.or(below.lift_weight),
        body_weight: above.body_weight.or(below.body_weight),
        bptt_weight: above.bptt_weight.or(below.bptt_weight),
        bptt_window: above.bptt_window.or(below.bptt_window),
        bptt_stride: above.bptt_stride.or(below.bptt_stride),
        bptt_decay: above.bptt_decay.or(below.bptt_decay),
        bptt_integrator: above.bptt_integrator.or(below.bptt_integrator),
        slack: above.slack.or(below.slack),
        degree: above.degree.or(below.degree),
        trigonometric: above.trigonometric || below.trigonometric,
        terms: above.terms.or(below.terms),
        actuators: above.actuators.or(below.actuators),
        wrench_frame: above.wrench_frame.or(below.wrench_frame),
        phases: above.phases.or(below.phases),
        leave_out_implausible: above.leave_out_implausible || below.leave_out_implausible,
        accelerations: above.accelerations.or(below.accelerations),
        smooth: above.smooth.or(below.smooth),
        smooth_rows: above.smooth_rows.or(below.smooth_rows),
        moving_average: above.moving_average.or(below.moving_average),
        mask_std: above.mask_std.or(below.mask_std),
        mask_input_share: above.mask_input_share.or(below.mask_input_share),
        no_rotation: above.no_rotation || below.no_rotation,
        state_scaling: above.state_scaling.or(below.state_scaling),
        torque_scaling: above.torque_scaling.or(below.torque_scaling),
        force_scaling: above.force_scaling.or(below.force_scaling),
        moment_scaling: above.moment_scaling.or(below.moment_scaling),
    }
}
