//! A training by any method: checked recordings, fitted maps and dynamics, metrics, the model with its origin.

use std::path::Path;

use serde_json::{Map, Value, json};
use sha2::{Digest, Sha256};

use super::frame::{parities, symmetry_classes};
use super::latent::mean_jacobian;
use super::metrics::measure;
use super::recipe::RecipePart;
use super::select::select;
use super::strides::learn_strides;
use super::subspace::{order_and_sign, varimax};
use super::weak_form::{check_terms, samples_of_all_phases};
use super::*;
use crate::files::hex;
use crate::model::{CoordinateNames, InputGivenState, JumpPrior, Phase, ScaleFactors, Scaling};

#[derive(Clone, Copy, Debug)]
pub struct Recordings<'a> {
    pub training: &'a [Recording],
    /// Used to choose between candidates; without any, the training recordings are.
    pub validation: &'a [Recording],
}

impl<'a> Recordings<'a> {
    pub fn new(training: &'a [Recording], validation: &'a [Recording]) -> Self {
        Self {
            training,
            validation,
        }
    }
}

pub(super) struct Task<'a> {
    pub training: Dataset,
    pub validation: Dataset, // may have no jump
    pub moments: Moments,
    pub library: Library,
    pub features: Features,
    pub active: Vec<usize>,
    pub frame: Frame,
    pub knowledge: Vec<Knowledge>, // of the dynamics in its coordinates, one per phase
    pub options: &'a TrainOptions,
    pub robot: &'static Robot,
}

impl<'a> Task<'a> {
    pub(super) fn new(
        recordings: Recordings<'_>,
        robot: &'static Robot,
        options: &'a TrainOptions,
    ) -> Result<Self> {
        options.check()?;
        let (scaling, smoothing) = (options.scaling.factors(), options.regression.smoothing);
        let rule = options.input_rule(robot);
        let read =
            |set: &[Recording]| Dataset::new(set, &rule, &options.phases, &scaling, smoothing);
        let mut training = read(recordings.training)?;
        if options.mirror_images() == MirrorImages::Added {
            training.add_mirror_images(recordings.training)?;
        }
        training.check_for_training()?;
        let validation = read(recordings.validation)?;
        let moments = training.moments();
        let least_std = options.encoder.least_std * options.scaling.state;
        let active = moments.active_coordinates(least_std, options.encoder.least_input_share);
        let (requested, body) = (options.latent_dim, options.body());
        let rows = (options.coordinates(), &body);
        let frame = Frame::new(
            &training,
            &active,
            requested,
            rows,
            &options.regression,
            robot,
        );
        if requested == 0 || requested > frame.dim() {
            return Err(TrainError::LatentDim {
                requested,
                active: frame.dim(),
            });
        }
        let library = options.library()?;
        let features = Features::new(&library);
        Ok(Self {
            knowledge: Knowledge::of_phases(&training, &features, &frame, &options.regression),
            training,
            validation,
            moments,
            features,
            library,
            active,
            frame,
            options,
            robot,
        })
    }
}

/// Where a training's numbers come from.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Origin {
    pub command: String,
    /// Recordings with their digests, in the order of use.
    pub recordings: Vec<SourceFile>,
}

#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct SourceFile {
    /// Path as on the command line.
    pub path: String,
    pub digest: String,
    /// The sets that its jumps came into, such as `test`, if a training divided them.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub sets: Vec<&'static str>,
}

impl Origin {
    /// The origin of a training on these files; those that can no longer be read have an empty digest.
    pub fn new(
        command: impl Into<String>,
        files: impl IntoIterator<Item = impl AsRef<Path>>,
    ) -> Self {
        let files = files.into_iter().map(|path| SourceFile {
            path: path.as_ref().display().to_string(),
            digest: std::fs::read(path.as_ref())
                .map(|bytes| sha256(&bytes))
                .unwrap_or_default(),
            sets: Vec::new(),
        });
        Self {
            command: command.into(),
            recordings: files.collect(),
        }
    }
}

/// SHA-256 of a file's bytes, with the name of the algorithm in front, as provenances have it.
pub fn sha256(bytes: &[u8]) -> String {
    format!("sha256:{}", hex(&Sha256::digest(bytes)))
}

impl Task<'_> {
    pub(super) fn assemble(
        &self,
        fitted: Fitted,
        jumps: Option<JumpPrior>,
        provenance: Map<String, Value>,
    ) -> Result<ReducedModel> {
        let (options, robot, training) = (self.options, self.robot, &self.training);
        let (d, name) = (options.latent_dim, robot.name);
        let given_state = self.inputs_given_states(&fitted);
        let strides = learn_strides(training);
        let motions = if strides.is_some() { "walks" } else { "jumps" };
        let [state, input] = CoordinateNames::of_robot();
        let mut builder = ReducedModel::builder(options.name.clone(), self.library.clone())
            .description(format!("{d} latent coordinates of {name} {motions}"))
            .robot(robot)
            .actuators(options.actuators.clone())
            .wrench_frame(options.wrench_frame)
            .state(state)
            .input(input)
            .scaling(Scaling {
                state: ScaleFactors::Uniform(options.scaling.state),
                input: ScaleFactors::PerCoordinate(options.scaling.factors().input),
            })
            .sample_time_s(training.median_step_s())
            .provenance(provenance)
            .encoder(fitted.maps.encoder)
            .decoder(fitted.maps.decoder)
            .jump_prior(jumps)
            .stride_prior(strides);
        let phases = training.phases.patterns.iter().zip(fitted.xi);
        for (index, ((pattern, xi), given_state)) in phases.zip(given_state).enumerate() {
            let (name, feet) = (pattern.name.clone(), pattern.feet.clone());
            let statistics = InputStatistics {
                given_state,
                ..training.input_statistics(index)
            };
            builder = builder.input_statistics(name.clone(), statistics);
            builder = builder.phase(Phase { name, feet, xi });
        }
        Ok(builder.build()?)
    }

    /// Distribution of the latent input given the latent state, one entry per phase; for linear encoders.
    fn inputs_given_states(&self, fitted: &Fitted) -> Vec<Option<InputGivenState>> {
        let Some(encoder) = fitted.maps.encoder.as_affine() else {
            return vec![None; fitted.xi.len()];
        };
        // Place and heading of the robot are in `z`, but its inputs do not depend on them.
        let shifts = encoder.weights().select_columns(&PLACE);
        let set = fitted.maps.training_set(self);
        let phases = fitted.xi.iter().enumerate();
        let given = phases.map(|(phase, xi)| {
            let (variables, ddz) = set.regression_samples(phase);
            let theta = (self.features).evaluate(&variables, &mut FeatureValues::default());
            InputGivenState::of_samples(&shifts, variables, &(ddz - theta * xi))
        });
        given.collect()
    }
}

pub(super) fn provenance(
    options: &TrainOptions,
    method: &str,
    origin: &Origin,
    report: &TrainReport,
) -> Map<String, Value> {
    let encoder = EncoderOptions {
        coordinates: options.coordinates(),
        ..options.encoder.clone()
    };
    let provenance = json!({
        "command": origin.command,
        "romc_version": env!("CARGO_PKG_VERSION"),
        "method": method,
        "seed": options.seed,
        "encoder_options": encoder,
        "recordings": origin.recordings,
        "report": report,
    });
    provenance.as_object().cloned().expect("an object")
}

pub(super) struct Maps {
    pub encoder: StateMap,
    pub decoder: StateMap,
    pub weights: DMatrix<f64>, // W_e, of a nonlinear encoder the mean Jacobian over the training samples
    pub training: Vec<Latent>,
    pub validation: Vec<Latent>,
}

impl Maps {
    pub(super) fn training_set<'a>(&'a self, task: &'a Task<'_>) -> EncodedSet<'a> {
        EncodedSet::new(&task.training, &self.training)
    }

    /// The jumps that candidates are judged by: those of the training where there are no others.
    pub(super) fn judged_set<'a>(&'a self, task: &'a Task<'_>) -> EncodedSet<'a> {
        match self.validation.is_empty() {
            true => self.training_set(task),
            false => EncodedSet::new(&task.validation, &self.validation),
        }
    }
}

pub(super) struct Fitted {
    pub maps: Maps,
    pub xi: Vec<Xi>,
    /// The regression, if Xi was chosen among regressions, and how many were tried.
    pub choice: Option<(Choice, usize)>,
    pub score: f64, // that seeds are compared by, see `SeedReport::score`
}

impl Fitted {
    fn measure(&self, features: &Features, set: EncodedSet<'_>) -> SetMetrics {
        let (xi, maps) = (&self.xi, [&self.maps.encoder, &self.maps.decoder]);
        measure(Candidate { features, xi }, maps, set)
    }
}

impl Task<'_> {
    /// The encoder of the held rows and, in its canonical basis, of a space with orthonormal `basis` (`18 x (d - h)`).
    pub(super) fn encoder_over(&self, basis: &DMatrix<f64>) -> Result<AffineMap> {
        let classes = match self.frame.is_spatial() && basis.ncols() > 0 {
            true => symmetry_classes(basis, self.robot).to_vec(),
            false => vec![basis.clone()],
        };
        let learned: Vec<_> = (classes.iter().filter(|class| class.ncols() > 0))
            .map(|class| self.canonical_basis(class).0)
            .collect();
        let held = self.frame.held.column_iter();
        let learned = learned.iter().flat_map(|class| class.column_iter());
        let rows: Vec<_> = held.chain(learned).collect();
        let weights = DMatrix::from_columns(&rows).transpose();
        let bias = -(&weights * mean(&self.training.states(None)));
        Ok(AffineMap::new("encoder", weights, bias)?)
    }

    /// `basis T` and the orthogonal `T` of varimax, body x and body z first, dominant entries positive.
    pub(super) fn canonical_basis(&self, basis: &DMatrix<f64>) -> (DMatrix<f64>, DMatrix<f64>) {
        let std = self.training.state_std();
        let loadings = |basis: &DMatrix<f64>| DMatrix::from_diagonal(&std) * basis;
        let mut basis = basis.clone();
        let mut turn = DMatrix::identity(basis.ncols(), basis.ncols());
        if self.options.encoder.rotate {
            turn = varimax(&loadings(&basis));
            basis *= &turn;
        }
        let (order, signs) = order_and_sign(&loadings(&basis), &[BODY_X, BODY_Z]);
        let arranged = |matrix: DMatrix<f64>| {
            let mut arranged = matrix.select_columns(&order);
            for (mut column, sign) in arranged.column_iter_mut().zip(&signs) {
                column *= *sign;
            }
            arranged
        };
        (arranged(basis), arranged(turn))
    }

    pub(super) fn encoded(&self, encoder: StateMap, decoder: StateMap) -> Maps {
        Maps {
            weights: mean_jacobian(&encoder, &self.training),
            training: Latent::of(&self.training, &encoder),
            validation: Latent::of(&self.validation, &encoder),
            encoder,
            decoder,
        }
    }

    pub(super) fn fit_dynamics(
        &self,
        (encoder, decoder): (StateMap, StateMap),
        monitor: &mut Monitor<'_>,
    ) -> Result<Fitted> {
        let maps = self.encoded(encoder, decoder);
        let (options, features) = (&self.options.regression, &self.features);
        let set = maps.training_set(self);
        check_terms(set, features, &self.library)?;
        let long = match options.has(RecipePart::WholeJumps) {
            true => self.frame.judged_over_jumps(set.latent_dim()),
            false => set.latent_dim(),
        };
        let judge = Judge::new(features, maps.judged_set(self), long);
        let mut knowledge = self.knowledge.clone();
        let mut mirror = Mirror::default();
        if self.frame.is_spatial() {
            let parity = parities(&maps.weights, self.robot);
            mirror = Mirror::of(&self.training.phases, features, &parity);
            for (phase, known) in knowledge.iter_mut().enumerate() {
                if mirror.is_own_image(phase) {
                    *known = known.with_parity(features, &parity);
                }
            }
        }
        let shares = knowledge.iter().any(Knowledge::shares_body);
        let samples = shares.then(|| samples_of_all_phases(set, features));
        for (phase, known) in knowledge.iter_mut().enumerate() {
            *known = known.with_flights(set, features, phase);
            if let Some(samples) = &samples {
                *known = known.with_shared_body(samples, features);
            }
        }
        let known = (&knowledge[..], &mirror);
        let (xi, choice, candidates) = select(set, known, &judge, options, monitor)?;
        Ok(Fitted {
            maps,
            xi,
            score: choice.score,
            choice: Some((choice, candidates)),
        })
    }

    pub(super) fn seed_report(
        &self,
        fitted: &Fitted,
        seed: u64,
        losses: Option<Losses>,
    ) -> SeedReport {
        let std = self.training.state_std();
        let names = Robot::state_names();
        let rows = fitted.maps.weights.row_iter();
        SeedReport {
            seed,
            score: fitted.score,
            losses,
            active: fitted.xi.iter().map(active_terms).sum(),
            dominant: (rows.map(|row| row.transpose().component_mul(&std).iamax()))
                .map(|largest| names[largest].clone())
                .collect(),
            judged: fitted.measure(&self.features, fitted.maps.judged_set(self)),
        }
    }

    /// `judged` are metrics on the jumps that candidates are judged by, kept if these are validation jumps.
    pub(super) fn report(&self, fitted: &Fitted, judged: &SetMetrics) -> TrainReport {
        let names = Robot::state_names();
        let phases = self.training.phases.names().into_iter().zip(&fitted.xi);
        let terms = phases.map(|(phase, xi)| PhaseTerms {
            phase,
            active: active_terms(xi),
        });
        let (choice, candidates) = fitted.choice.clone().unzip();
        let validated = !self.validation.jumps.is_empty();
        let set = fitted.maps.training_set(self);
        TrainReport {
            encoded: self.active.iter().map(|&i| names[i].clone()).collect(),
            lift_loss: self.lift_loss(&fitted.maps.encoder, set),
            active_terms: terms.collect(),
            choice,
            candidates: candidates.unwrap_or(0),
            seeds: Vec::new(),
            support_overlap: None,
            deviations: Vec::new(),
            training: fitted.measure(&self.features, set),
            validation: validated.then(|| judged.clone()),
        }
    }

    fn lift_loss(&self, encoder: &StateMap, set: EncodedSet<'_>) -> f64 {
        if let Some(linear) = encoder.as_affine() {
            let (weights, input) = (linear.weights(), &self.moments.input);
            let carried = &input_projection(weights) * input * weights.transpose();
            return 1.0 - carried.trace() / input.trace().max(f64::MIN_POSITIVE);
        }
        let (mut missed, mut total) = (0.0, 0.0);
        for (jump, samples) in set.dataset.jumps.iter().zip(set.latent) {
            missed += (lift_samples(encoder, &jump.x, &samples.u_lat) - &jump.u).norm_squared();
            total += jump.u.norm_squared();
        }
        missed / total.max(f64::MIN_POSITIVE)
    }
}
