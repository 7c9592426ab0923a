//! The settings of `romc train`: from flags and a file to options, and back to flags for the provenance.

use std::fmt::Write as _;
use std::path::Path;

use serde_json::{Map, Value};

use super::args::{PhaseSet, TrainArguments, TrainSettings, Widths};
use super::output::{note, quoted_text, read_settings};
use super::prepared_recordings::RecordedSets;
use super::robot::chosen;
use crate::Error;
use crate::identify::{IdentifyError, identify};
use crate::limits::of_training;
use crate::limits::table::LAYER_WIDTH;
use crate::model::{Activation, LibraryChoice, StandardLibrary};
use crate::recording::{ConditionOptions, ImplausibleSamples, PhaseRule};
use crate::robot::{Actuators, Robot};
use crate::robot_file::read_actuators;
use crate::train::{
    Coordinates, MIN_SAMPLES, MapOptions, Method, ScaleOptions, TrainError, TrainOptions,
};

/// The word for actuators that stands for no file.
const NONE: &str = "none";
/// The word that stands for what the training recordings tell.
const IDENTIFIED: &str = "identify";
/// Files of recordings that tell it, at most.
const IDENTIFIED_FROM: usize = 20;

/// The options that the settings describe; actuators that recordings tell are still to be [`identified`].
pub(crate) fn options(
    settings: &TrainSettings,
    latent_dim: usize,
    name: String,
    robot: &Robot,
) -> Result<TrainOptions, Error> {
    let mut options = match settings.paper {
        true => TrainOptions::paper(name, latent_dim),
        false => TrainOptions::new(name, latent_dim),
    };
    if method(settings) == Method::Joint && !settings.paper {
        options.n_seeds = 3;
    }
    set(&mut options.seed, settings.seed);
    set(&mut options.n_seeds, settings.seeds);
    let joint = &mut options.joint;
    set(&mut joint.schedule.epochs, settings.epochs);
    set(&mut joint.weights.bptt, settings.bptt_weight);
    set(&mut joint.unroll.window, settings.bptt_window);
    set(&mut joint.unroll.stride, settings.bptt_stride);
    set(&mut joint.unroll.decay, settings.bptt_decay);
    set(&mut joint.unroll.integrator, settings.bptt_integrator);
    joint.maps = maps(settings);
    let encoder = &mut options.encoder;
    set(&mut encoder.lift_weight, settings.lift_weight);
    set(&mut encoder.body_weight, settings.body_weight);
    set(&mut encoder.least_std, settings.mask_std);
    set(&mut encoder.least_input_share, settings.mask_input_share);
    set(&mut encoder.coordinates, settings.coordinates);
    encoder.rotate &= !settings.no_rotation;
    set(&mut options.regression.slack, settings.slack);
    set(&mut options.regression.refinements, settings.refinements);
    let growth = settings.growth.map(|rate| Some(f64::from(rate)));
    set(&mut options.regression.growth_per_s, growth);
    set(&mut options.regression.smoothing, settings.moving_average);
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
    options.actuators = match actuators(settings) {
        NONE | IDENTIFIED => None,
        path => Some(read_actuators(Path::new(path), Some(robot))?),
    };
    Ok(options)
}

/// Sets the actuators that are identified from the first training recordings, if the settings want those; where there
/// are none, a note on stderr says so.
///
/// # Errors
/// [`IdentifyError::Contradiction`] for recordings that are not of one robot, also where no actuators are wanted.
pub(crate) fn identified(
    options: &mut TrainOptions,
    settings: &TrainSettings,
    recorded: &RecordedSets,
    robot: &Robot,
) -> Result<(), Error> {
    let found = identify(&recorded.first(IDENTIFIED_FROM)?, robot);
    if actuators(settings) != IDENTIFIED
        && !matches!(found, Err(IdentifyError::Contradiction { .. }))
    {
        return Ok(());
    }
    let found: Result<Actuators, String> = match found {
        Err(refused @ IdentifyError::Contradiction { .. }) => return Err(refused.into()),
        Ok(found) => found.contradiction().map_or(Ok(found.actuators), Err),
        Err(reason) => Err(reason.to_string()),
    };
    options.actuators = found
        .inspect_err(|reason| {
            note(&format!(
                "torques are those of the motors, as the recordings do not tell the joints' losses: {reason}"
            ));
        })
        .ok();
    Ok(())
}

pub(crate) fn robot(settings: &TrainSettings) -> Result<&'static Robot, Error> {
    chosen(settings.robot.as_deref().unwrap_or("go1"))
}

pub(crate) fn conditioning(settings: &TrainSettings) -> ConditionOptions {
    let rows = settings.smooth_rows.unwrap_or_default();
    ConditionOptions {
        implausible: match settings.leave_out_implausible {
            true => ImplausibleSamples::LeaveOut,
            false => ImplausibleSamples::Keep,
        },
        least_samples: MIN_SAMPLES,
        accelerations: settings.accelerations.unwrap_or_default(),
        smoothing: settings.smooth.clone().map(|filter| (filter, rows)),
    }
}

/// The layers of encoder and decoder; the decoder mirrors the encoder unless it is described itself.
fn maps(settings: &TrainSettings) -> MapOptions {
    let widths = |given: &Option<Widths>| given.as_ref().map(|widths| widths.0.clone());
    let encoder_layers = widths(&settings.encoder_layers).unwrap_or_default();
    MapOptions {
        decoder_layers: widths(&settings.decoder_layers)
            .unwrap_or_else(|| encoder_layers.iter().rev().copied().collect()),
        encoder_layers,
        activation: settings.activation.unwrap_or(Activation::Elu),
    }
}

/// The method that is asked for: the joint one if a setting is given that it alone knows.
pub(crate) fn method(settings: &TrainSettings) -> Method {
    let default = match of_the_joint_method(settings) {
        None => Method::ClosedForm,
        Some(_) => Method::Joint,
    };
    settings.method.unwrap_or(default)
}

/// Where the joints' losses come from: a file, [`NONE`] or [`IDENTIFIED`].
pub(crate) fn actuators(settings: &TrainSettings) -> &str {
    let default = match settings.paper {
        true => NONE,
        false => IDENTIFIED,
    };
    settings.actuators.as_deref().unwrap_or(default)
}

fn of_the_joint_method(settings: &TrainSettings) -> Option<&'static str> {
    let layers = match settings.encoder_layers {
        Some(_) => "encoder-layers",
        None => "decoder-layers",
    };
    let layers = (!maps(settings).is_linear()).then_some(layers);
    first(settings, &["paper", "epochs"])
        .or(layers)
        .or_else(|| first(settings, &["bptt-weight"]))
        .or_else(|| first(settings, &WINDOW))
}

/// The settings of the window of predictions beside its weight.
const WINDOW: [&str; 4] = [
    "bptt-window",
    "bptt-stride",
    "bptt-decay",
    "bptt-integrator",
];

pub(crate) fn first(settings: &TrainSettings, names: &[&'static str]) -> Option<&'static str> {
    let given = given(settings);
    names.iter().copied().find(|name| given.contains_key(*name))
}

fn library(settings: &TrainSettings, default: LibraryChoice) -> LibraryChoice {
    match (&settings.terms, default) {
        (Some(terms), _) => {
            LibraryChoice::Terms(terms.split(';').map(|t| t.trim().to_owned()).collect())
        }
        (None, LibraryChoice::Standard(standard)) => LibraryChoice::Standard(StandardLibrary {
            degree: settings.degree.unwrap_or(standard.degree),
            trigonometric: settings.trigonometric || standard.trigonometric,
            inputs: standard.inputs,
        }),
        (None, terms @ LibraryChoice::Terms(_)) => terms,
    }
}

fn set<T>(option: &mut T, given: Option<impl Into<T>>) {
    if let Some(value) = given {
        *option = value.into();
    }
}

fn given(settings: &TrainSettings) -> Map<String, Value> {
    let Ok(Value::Object(mut given)) = serde_json::to_value(settings) else {
        unreachable!("settings are a struct of numbers, texts and switches");
    };
    given.retain(|_, value| !matches!(value, Value::Null | Value::Bool(false)));
    given
}

/// The flags that were given, with a space before each.
pub(crate) fn as_flags(settings: &TrainSettings) -> String {
    let mut line = String::new();
    for (name, value) in given(settings) {
        let text = match value {
            Value::Bool(_) => String::new(),
            Value::Number(number) => match number.as_u64() {
                Some(count) => format!(" {count}"),
                None => format!(" {}", number.as_f64().unwrap_or(f64::NAN)),
            },
            Value::String(text) => format!(" {}", quoted_text(&text)),
            Value::Array(widths) if widths.is_empty() => " linear".to_owned(),
            Value::Array(widths) => {
                let widths: Vec<String> = widths.iter().map(Value::to_string).collect();
                format!(" {}", widths.join(","))
            }
            Value::Null | Value::Object(_) => continue,
        };
        let _ = write!(line, " --{name}{text}");
    }
    line
}

/// The settings of the command line over those of its file, if it names one.
pub(crate) fn effective(arguments: &TrainArguments) -> Result<TrainSettings, Error> {
    let mut settings = arguments.settings.clone();
    if let Some(path) = &arguments.config {
        let mut merged = given(&read(path)?);
        merged.extend(given(&settings));
        settings = serde_json::from_value(Value::Object(merged)).expect("names are all known");
        if settings.latent_dim.is_none() {
            let message = "`latent-dim` is missing, here and on the command line";
            return Err(Error::refused(path, message));
        }
    }
    check_pairs(&settings)?;
    Ok(settings)
}

/// Refuses settings that the method does not use, an activation without hidden layers, rows to filter without a filter,
/// and named coordinates where a method learns others.
pub(crate) fn check_pairs(settings: &TrainSettings) -> Result<(), Error> {
    let (method, is_linear) = (method(settings), maps(settings).is_linear());
    let given = |names: &[&'static str], when: bool| first(settings, names).filter(|_| when);
    let has_weight = settings
        .bptt_weight
        .is_some_and(|weight| f64::from(weight) != 0.0);
    let is_named = settings.coordinates == Some(Coordinates::Named);
    let is_published = settings.paper && method == Method::Joint;
    let activation = settings.activation.unwrap_or(Activation::Elu);
    let of_choice = ["slack", "refinements", "growth", "no-rotation"];
    let faults = [
        (
            of_the_joint_method(settings).filter(|_| method == Method::ClosedForm),
            "set for the closed form, which does not use it",
            "`--method joint`, or no method",
        ),
        (
            given(&WINDOW, !has_weight),
            "set for a loss without weight",
            "`--bptt-weight` above 0 beside it",
        ),
        (
            given(&["activation"], is_linear),
            &format!("{activation} without hidden layers"),
            "`--encoder-layers` or `--decoder-layers` beside it",
        ),
        (
            given(&["coordinates"], is_named && !is_linear),
            "named with hidden layers",
            "free, or maps without hidden layers",
        ),
        (
            given(&["coordinates"], is_named && is_published),
            "named with the published joint training",
            "free, or a training without `--paper`",
        ),
        (
            given(&of_choice, settings.paper),
            "set for the published training, which neither chooses terms nor turns the basis",
            "a training without `--paper`",
        ),
        (
            given(&["smooth-rows"], settings.smooth.is_none()),
            "set without a filter",
            "`--smooth` beside it",
        ),
    ];
    for (option, found, expected) in faults {
        if let Some(option) = option {
            let found = found.to_owned();
            return Err(TrainError::Option {
                option,
                found,
                expected,
            }
            .into());
        }
    }
    Ok(())
}

/// The first setting that this training does not depend on, in words: two named coordinates are those of the
/// centre of mass, which nothing searches, and the search of the closed form ends in one model from every start.
pub(crate) fn without_effect(settings: &TrainSettings, options: &TrainOptions) -> Option<String> {
    let is_closed = method(settings) == Method::ClosedForm;
    let is_held = options.coordinates() == Coordinates::Named && options.latent_dim == 2;
    let searched = ["lift-weight", "body-weight", "no-rotation"];
    if let (Some(name), true) = (first(settings, &searched), is_closed && is_held) {
        return Some(format!(
            "--{name}: without effect, as both named coordinates are those of the centre of mass"
        ));
    }
    let name = first(settings, &["seed", "seeds"]).filter(|_| is_closed)?;
    Some(format!(
        "--{name}: the closed form finds the same model from every start; of it only --split depends on the seed"
    ))
}

pub(crate) fn read(path: &Path) -> Result<TrainSettings, Error> {
    read_settings(path, check)
}

/// The checks of clap, for settings that came from a file.
fn check(settings: &TrainSettings) -> Result<(), String> {
    for (name, value) in &given(settings) {
        let (numbers, range) = match value {
            Value::Array(widths) => (widths.as_slice(), Some(&LAYER_WIDTH)),
            single => (std::slice::from_ref(single), of_training(name)),
        };
        for number in numbers.iter().filter_map(Value::as_f64) {
            if let Some(Err(refusal)) = range.map(|range| range.check(number)) {
                return Err(format!(
                    "`{name}` is {}, expected {}",
                    refusal.found, refusal.expected
                ));
            }
        }
    }
    let fault =
        if settings.terms.is_some() && first(settings, &["degree", "trigonometric"]).is_some() {
            "`terms` stands beside `degree` or `trigonometric`, expected one or the other"
        } else if settings.activation == Some(Activation::Linear) {
            "`activation` is linear, expected elu, tanh, sigmoid, relu, gelu, silu or softplus"
        } else {
            return Ok(());
        };
    Err(fault.to_owned())
}
