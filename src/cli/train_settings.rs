//! The settings of `romc train`: from flags and a file to options, and back to flags for the provenance.

use super::robot::chosen;
use super::*;
use crate::identify::{IdentifyError, identify};
use crate::limits::table::{LAYER_WIDTH, of_training};
use clap::ValueEnum as _;

/// The word for no actuators.
const NONE: &str = "none";
const IDENTIFIED: &str = "identify";
const IDENTIFIED_FROM: usize = 20;

/// The settings of the prediction window, except its weight.
const WINDOW: &str = "bptt-window bptt-stride bptt-decay bptt-integrator";

impl TrainSettings {
    pub(super) fn read(path: &Path) -> Result<Self> {
        read_settings(path, Self::check)
    }

    pub(super) fn effective(arguments: &TrainArguments) -> Result<Self> {
        let mut settings = arguments.settings.clone();
        if let Some(path) = &arguments.config {
            let mut merged = Self::read(path)?.given();
            merged.extend(settings.given());
            settings = serde_json::from_value(Value::Object(merged)).expect("names are all known");
            if settings.latent_dim.is_none() {
                let message = "`latent-dim` is missing, here and on the command line";
                return Err(Error::refused(path, message));
            }
        }
        settings.check_pairs()?;
        Ok(settings)
    }

    /// Without [identified](Self::identify) actuators.
    pub(super) fn options(
        &self,
        latent_dim: usize,
        name: String,
        robot: &Robot,
    ) -> Result<TrainOptions> {
        let mut options = match self.paper {
            true => TrainOptions::paper(name, latent_dim),
            false => TrainOptions::new(name, latent_dim),
        };
        if self.method() == Method::Joint && !self.paper {
            options.n_seeds = 3;
        }
        set(&mut options.seed, self.seed);
        set(&mut options.n_seeds, self.seeds);
        let joint = &mut options.joint;
        set(&mut joint.schedule.epochs, self.epochs);
        set(&mut joint.weights.bptt, self.bptt_weight);
        set(&mut joint.unroll.window, self.bptt_window);
        set(&mut joint.unroll.stride, self.bptt_stride);
        set(&mut joint.unroll.decay, self.bptt_decay);
        set(&mut joint.unroll.integrator, self.bptt_integrator);
        joint.maps = self.maps();
        let encoder = &mut options.encoder;
        set(&mut encoder.lift_weight, self.lift_weight);
        set(&mut encoder.body_weight, self.body_weight);
        set(&mut encoder.least_std, self.mask_std);
        set(&mut encoder.least_input_share, self.mask_input_share);
        set(&mut encoder.coordinates, self.coordinates);
        encoder.rotate &= !self.no_rotation;
        encoder.mirror_images = self.mirror_images;
        let body = self
            .body
            .clone()
            .or_else(|| self.walks(&options).then(BodyRows::all));
        if let Some(body) = body {
            options.set_body(body);
        }
        set(&mut options.regression.leave_out, self.leave_out.clone());
        let shared = self.walks(&options).then_some(BodyEquations::AllPhases);
        set(
            &mut options.regression.body_equations,
            self.body_equations.or(shared),
        );
        set(&mut options.regression.slack, self.slack);
        set(&mut options.regression.refinements, self.refinements);
        let growth = self.growth.map(|rate| Some(f64::from(rate)));
        set(&mut options.regression.growth_per_s, growth);
        set(&mut options.regression.smoothing, self.moving_average);
        set(&mut options.wrench_frame, self.wrench_frame);
        if !self.paper {
            options.scaling = ScaleOptions::in_frame(options.wrench_frame);
        }
        set(&mut options.scaling.state, self.state_scaling);
        set(&mut options.scaling.torque, self.torque_scaling);
        set(&mut options.scaling.force, self.force_scaling);
        set(&mut options.scaling.moment, self.moment_scaling);
        options.library = self.library(options.library);
        if let Some(rule) = self.phase_rule() {
            options.phases = rule.with_min_samples(options.phases.min_samples);
        }
        options.actuators = match self.actuators() {
            NONE | IDENTIFIED => None,
            path => Some(read_actuators(Path::new(path), Some(robot))?),
        };
        Ok(options)
    }

    /// Whether the phases are those of a walk and there are enough latent coordinates for the whole body.
    fn walks(&self, options: &TrainOptions) -> bool {
        let is_walk = matches!(self.phases, Some(PhaseSet::Trot | PhaseSet::Crawl));
        let body = BodyRows::all();
        is_walk && body.fits(options.latent_dim) && options.coordinates() == Coordinates::Named
    }

    /// Leaves out phases of a walk that do not occur in the training recordings, with a note for each. Another note is
    /// printed if no phases were chosen and contacts do not look like a jump.
    pub(super) fn check_phases(
        &self,
        options: &mut TrainOptions,
        training: &[Recording],
    ) -> Result<()> {
        if let Some(PhaseSet::Trot | PhaseSet::Crawl) = self.phases {
            let (rule, rare) = (options.phases.clone()).without_rare(training, MIN_SAMPLES)?;
            options.phases = rule;
            for (phase, samples) in rare {
                note(&format!(
                    "phase `{phase}` is left out: {samples} samples in the training recordings"
                ));
            }
        }
        let motion = PhaseSet::of(training);
        let is_default = self.phases.is_none() && self.phase.is_none();
        if let Some(name) = motion.to_possible_value()
            && is_default
            && motion != PhaseSet::Jump
        {
            let name = name.get_name();
            note(&format!(
                "contacts look like those of `--phases {name}`; without it the phases are contact and flight"
            ));
        }
        Ok(())
    }

    fn phase_rule(&self) -> Option<PhaseRule> {
        let patterns = self.phase.clone().map(PhaseRule::new);
        patterns.or(self.phases.map(PhaseSet::rule))
    }

    /// Sets the actuators identified from the first training recordings, if requested. Recordings of different robots
    /// are always refused.
    pub(super) fn identify(
        &self,
        options: &mut TrainOptions,
        recorded: &RecordedSets,
        robot: &Robot,
    ) -> Result<()> {
        let found = match identify(&recorded.first(IDENTIFIED_FROM)?, robot) {
            Err(refused @ IdentifyError::Contradiction { .. }) => return Err(refused.into()),
            _ if self.actuators() != IDENTIFIED => return Ok(()),
            Ok(found) => found
                .contradiction()
                .map_or(Ok(found.actuators_and_legs()), Err),
            Err(reason) => Err(reason.to_string()),
        };
        let found = found.inspect_err(|reason| {
            note(&format!(
                "torques are those of the motors, because joint friction and rotor inertia cannot be identified from the recordings: {reason}"
            ));
        });
        options.actuators = found.ok(); // the note states the reason
        Ok(())
    }

    pub(super) fn robot(&self) -> Result<&'static Robot> {
        chosen(self.robot.as_deref().unwrap_or("go1"))
    }

    pub(super) fn conditioning(&self) -> ConditionOptions {
        let rows = self.smooth_rows.unwrap_or_default();
        ConditionOptions {
            implausible: match self.leave_out_implausible {
                true => ImplausibleSamples::LeaveOut,
                false => ImplausibleSamples::Keep,
            },
            least_samples: MIN_SAMPLES,
            accelerations: self.accelerations.unwrap_or_default(),
            smoothing: self.smooth.clone().map(|filter| (filter, rows)),
        }
    }

    /// The decoder has the encoder's layers in reverse unless it has its own.
    fn maps(&self) -> MapOptions {
        let widths = |given: &Option<Widths>| given.as_ref().map(|widths| widths.0.clone());
        let encoder_layers = widths(&self.encoder_layers).unwrap_or_default();
        MapOptions {
            decoder_layers: widths(&self.decoder_layers)
                .unwrap_or_else(|| encoder_layers.iter().rev().copied().collect()),
            encoder_layers,
            activation: self.activation.unwrap_or(Activation::Elu),
        }
    }

    /// By default the joint method if one of its own settings is given.
    pub(super) fn method(&self) -> Method {
        self.method.unwrap_or(match self.of_the_joint_method() {
            None => Method::ClosedForm,
            Some(_) => Method::Joint,
        })
    }

    /// Where the joints' losses come from: a file, [`NONE`] or [`IDENTIFIED`].
    pub(super) fn actuators(&self) -> &str {
        let default = if self.paper { NONE } else { IDENTIFIED };
        self.actuators.as_deref().unwrap_or(default)
    }

    fn of_the_joint_method(&self) -> Option<&'static str> {
        let layers = match self.encoder_layers {
            Some(_) => "encoder-layers",
            None => "decoder-layers",
        };
        self.first("paper epochs")
            .or((!self.maps().is_linear()).then_some(layers))
            .or_else(|| self.first("bptt-weight").or(self.first(WINDOW)))
    }

    /// The first of these settings, by name, that is given.
    pub(super) fn first(&self, names: &'static str) -> Option<&'static str> {
        let given = self.given();
        names.split(' ').find(|name| given.contains_key(*name))
    }

    fn library(&self, default: Option<LibraryChoice>) -> Option<LibraryChoice> {
        if let Some(terms) = &self.terms {
            let terms = terms.split(';').map(|term| term.trim().to_owned());
            return Some(LibraryChoice::Terms(terms.collect()));
        }
        if self.degree.is_none() && !self.trigonometric {
            return default;
        }
        let (degree, trigonometric, inputs) = match default {
            Some(LibraryChoice::Standard(of)) => (of.degree, of.trigonometric, of.inputs),
            Some(LibraryChoice::Terms(_)) | None => (1, false, true),
        };
        Some(LibraryChoice::Standard(StandardLibrary {
            degree: self.degree.unwrap_or(degree),
            trigonometric: self.trigonometric || trigonometric,
            inputs,
        }))
    }

    fn given(&self) -> Map<String, Value> {
        let Ok(Value::Object(mut given)) = serde_json::to_value(self) else {
            unreachable!("settings are a struct of numbers, texts and switches");
        };
        given.retain(|_, value| !matches!(value, Value::Null | Value::Bool(false)));
        given
    }

    pub(super) fn as_flags(&self) -> String {
        let flag = |(name, value): (String, Value)| match value {
            Value::Bool(_) | Value::Null | Value::Object(_) => format!(" --{name}"),
            Value::Number(number) => match number.as_u64() {
                Some(count) => format!(" --{name} {count}"),
                None => format!(" --{name} {}", number.as_f64().unwrap_or(f64::NAN)),
            },
            Value::String(text) => format!(" --{name} {}", quoted_text(&text)),
            Value::Array(patterns) if name == "phase" => {
                let patterns = patterns.iter().filter_map(Value::as_str);
                let flags = patterns.map(|text| format!(" --phase {}", quoted_text(text)));
                flags.collect()
            }
            Value::Array(values) if values.is_empty() => format!(" --{name} linear"),
            Value::Array(values) => {
                let values: Vec<String> = values.iter().map(Value::to_string).collect();
                format!(" --{name} {}", values.join(",").replace('"', ""))
            }
        };
        self.given().into_iter().map(flag).collect()
    }

    /// Refuses settings that have no effect together with the others.
    pub(super) fn check_pairs(&self) -> Result<()> {
        let (method, is_linear) = (self.method(), self.maps().is_linear());
        let given = |names, when: bool| self.first(names).filter(|_| when);
        let has_weight = (self.bptt_weight).is_some_and(|weight| f64::from(weight) != 0.0);
        let is_named = self.coordinates == Some(Coordinates::Named);
        let is_free = self.coordinates == Some(Coordinates::Free);
        let is_published = self.paper && method == Method::Joint;
        let activation = self.activation.unwrap_or(Activation::Elu);
        let of_choice = "slack refinements growth no-rotation";
        let faults = [
            (
                (self.of_the_joint_method()).filter(|_| method == Method::ClosedForm),
                "set for the closed form, which does not use it",
                "`--method joint`, or no method",
            ),
            (
                given(WINDOW, !has_weight),
                "set for a loss without weight",
                "`--bptt-weight` above 0 as well",
            ),
            (
                given("activation", is_linear),
                &format!("{activation} without hidden layers"),
                "`--encoder-layers` or `--decoder-layers` as well",
            ),
            (
                given("coordinates", is_named && !is_linear),
                "named with hidden layers",
                "free, or maps without hidden layers",
            ),
            (
                given("coordinates", is_named && is_published),
                "named with the published joint training",
                "free, or a training without `--paper`",
            ),
            (
                given(
                    "body body-equations leave-out",
                    !is_linear || self.paper || is_free,
                ),
                "set with free coordinates",
                "named coordinates, which have rows of the body",
            ),
            (
                given(of_choice, self.paper),
                "set for the published training, which neither chooses terms nor turns the basis",
                "a training without `--paper`",
            ),
            (
                given("smooth-rows", self.smooth.is_none()),
                "set without a filter",
                "`--smooth` as well",
            ),
        ];
        let fault = faults.into_iter().find_map(|(option, found, expected)| {
            let (option, found) = (option?, found.to_owned());
            Some(TrainError::Option {
                option,
                found,
                expected,
            })
        });
        fault.map_or(Ok(()), |fault| Err(fault.into()))
    }

    /// The first setting that this training does not depend on, in words.
    pub(super) fn without_effect(&self, options: &TrainOptions) -> Option<String> {
        let is_held = options.coordinates() == Coordinates::Named && options.latent_dim == 2;
        let searched = self.first("lift-weight body-weight no-rotation");
        let searched = searched.filter(|_| is_held);
        let words = match (searched, self.first("seed seeds")) {
            _ if self.method() != Method::ClosedForm => return None,
            (Some(name), _) => format!(
                "--{name}: without effect, as both named coordinates are those of the centre of mass"
            ),
            (None, name) => format!(
                "--{}: the closed form finds the same model from every start; of it only --split depends on the seed",
                name?
            ),
        };
        Some(words)
    }

    /// The checks of clap, for settings from a file.
    fn check(&self) -> Result<(), String> {
        for (name, value) in &self.given() {
            let (numbers, range) = match value {
                Value::Array(widths) => (widths.as_slice(), Some(&LAYER_WIDTH)),
                single => (std::slice::from_ref(single), of_training(name)),
            };
            for number in numbers.iter().filter_map(Value::as_f64) {
                if let Some(Err(refusal)) = range.map(|range| range.check(number)) {
                    let (found, expected) = (refusal.found, refusal.expected);
                    return Err(format!("`{name}` is {found}, expected {expected}"));
                }
            }
        }
        let has_parts = self.first("degree trigonometric").is_some();
        let fault = if self.terms.is_some() && has_parts {
            "`terms` is set together with `degree` or `trigonometric`, expected one or the other"
        } else if self.phase.is_some() && self.phases.is_some() {
            "`phase` is set together with `phases`, expected one or the other"
        } else if self.activation == Some(Activation::Linear) {
            "`activation` is linear, expected elu, tanh, sigmoid, relu, gelu, silu or softplus"
        } else {
            return Ok(());
        };
        Err(fault.to_owned())
    }
}
