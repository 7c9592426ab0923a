//! What is generated for a model: programs, with names, roles and documentation.

use super::code::{Parameter, Role};
use super::map_equations::{in_matrices, points, titles, without_factors};
use super::options::Units;
use crate::equations::{Equations, LatentUnits, Unit, summand_words};
use crate::ir::{Program, Slot, Statement};
use crate::lower::{self, Form, JacobianPattern, LowerError, Map};
use crate::model::{CandidateTerm, CoordinateNames, ModelError, ReducedModel};
use crate::robot::WrenchFrame;
use crate::robot::kinematics::{LEAST_HEIGHT, LEAST_SPAN};

/// Longest equation that documentation spells out, in terms.
const MOST_TERMS: usize = 40;

/// A function to be generated from a program.
#[derive(Clone, Debug)]
pub struct FunctionSpec {
    /// Name without the model's, such as `contact_dynamics`.
    pub name: String,
    /// The program.
    pub program: Program,
    /// Parameters in order.
    pub parameters: Vec<Parameter<String>>,
    /// Lines of documentation.
    pub docs: Vec<String>,
}

/// The functions of one phase.
#[derive(Clone, Debug)]
pub struct PhaseInterface {
    /// Name of the phase as an identifier.
    pub identifier: String,
    /// `ddz`.
    pub dynamics: FunctionSpec,
    /// `ddz` and its Jacobian.
    pub jacobian: FunctionSpec,
    /// Where the Jacobian's entries stand.
    pub pattern: JacobianPattern,
    /// One Runge-Kutta step.
    pub step: FunctionSpec,
}

/// Everything that is generated for a model.
#[derive(Clone, Debug)]
pub struct ModelInterface {
    /// Name of the model as an identifier.
    pub identifier: String,
    /// Name of the model.
    pub name: String,
    /// Units of robot coordinates at the interface.
    pub units: Units,
    /// Whether latent quantities are in physical units instead of the model's scaled ones.
    pub is_physical: bool,
    /// Number of latent coordinates.
    pub latent_dim: usize,
    /// Number of robot coordinates, if the model speaks of any.
    pub state_dim: Option<usize>,
    /// The generalised inputs and the maps, where the model has the data for them.
    pub maps: Vec<FunctionSpec>,
    /// Phases in the order of the model.
    pub phases: Vec<PhaseInterface>,
}

impl ModelInterface {
    /// Lowers all functions of a model.
    ///
    /// # Errors
    /// [`LowerError`] if a phase cannot be lowered.
    pub fn new(system: &Equations<'_>, form: Form, units: Units) -> Result<Self, LowerError> {
        let model = &units.convert(system.model())?;
        let phases = (0..model.phases().len())
            .map(|phase| phase_entries(system, phase, form))
            .collect::<Result<_, _>>()?;
        Ok(Self {
            identifier: model.identifier().to_string(),
            name: model.name().to_owned(),
            units,
            is_physical: system.latent_units().is_some(),
            latent_dim: model.latent_dim(),
            state_dim: model.state_dim(),
            maps: match units {
                Units::Si => input_entries(model)?
                    .into_iter()
                    .chain(map_entries(model, units, system.latent_units())?)
                    .collect(),
                Units::Scaled => map_entries(model, units, None)?,
            },
            phases,
        })
    }

    pub(super) fn units_in_words(&self) -> String {
        let robot = self.units.of_robot();
        match self.is_physical {
            true => format!(
                "metres, radians, newtons and seconds as each function states, robot coordinates in {robot}"
            ),
            false => format!("the model's scaled units, robot coordinates in {robot}"),
        }
    }

    pub(super) fn has(&self, is_wanted: impl Fn(&Statement) -> bool) -> bool {
        self.all().any(|entry| entry.program.has(&is_wanted))
    }

    pub(crate) fn all(&self) -> impl Iterator<Item = &FunctionSpec> {
        let phases = self
            .phases
            .iter()
            .flat_map(|phase| [&phase.dynamics, &phase.jacobian, &phase.step]);
        self.maps.iter().chain(phases)
    }
}

pub(super) fn computes_angles(statement: &Statement) -> bool {
    matches!(statement, Statement::SinCos { .. })
}

/// What computes the input of the maps, and torques of the motors from it, if the model is over a
/// known robot's coordinates.
fn input_entries(model: &ReducedModel) -> Result<Vec<FunctionSpec>, LowerError> {
    let (Some(input), Some(torque)) = (
        lower::generalised_input(model)?,
        lower::actuator_torque(model)?,
    ) else {
        return Ok(Vec::new());
    };
    let robot = model.robot()?.name();
    let has_losses = model.actuators().is_some();
    let axes = match model.wrench_frame() {
        WrenchFrame::Body => {
            "Axes are parallel to the body's: x forward, y left, z up. The arm p_k of a moment is the foot in \
             its own hip frame, as in the data that models are learned from."
        }
        WrenchFrame::World => {
            "Axes are the world's; the arm p_k of a moment is the foot from the body's origin. The three \
             moments are the generalised forces of roll, pitch and yaw: they do work on the rates of these \
             angles."
        }
    };
    let (net, losses) = match has_losses {
        true => (
            "the torques at the links, tau less the joints' viscous and dry friction b dq + c tanh(dq / \
             0.05 rad/s)",
            "tau = net + b dq + c tanh(dq / 0.05 rad/s) + I ddq with the joints' friction and the inertia of \
             the motors.",
        ),
        false => (
            "the torques as they are: the model knows no losses of the joints, dx is not used",
            "tau = net: the model knows no losses of the joints, dx and ddx are not used.",
        ),
    };
    let input_docs = vec![
        format!(
            "Generalised inputs of the {robot}: u = [net; sum of F_k; sum of p_k x F_k] over the feet on \
             the ground, F_k = -J_k^-T net_k the force on the body (equations 4 to 7, 22, 23)."
        ),
        format!(
            "x, dx: robot coordinates and their velocities in SI units. tau: torques of the motors (N m). \
             feet: 1 on the ground, 0 in the air, order fr, fl, rr, rl. u: net, force (N) and moment (N m) \
             on the body. net: {net}. What the inertia of the motors takes is not in it, it would need \
             accelerations."
        ),
        axes.to_owned(),
        format!(
            "Near a singularity of a leg on the ground its force is damped: a knee that spans less than \
             {LEAST_SPAN} of thigh times calf, a foot nearer to its hip's height than {LEAST_HEIGHT} of the \
             leg."
        ),
    ];
    let torque_docs = vec![
        format!("Torques of the {robot}'s motors behind torques at the links: {losses}"),
        "dx, ddx: velocities and accelerations of the robot coordinates in SI units, of which the joints \
         count (0 to 11). net: the first 12 of u (N m). tau: torques of the motors (N m); limits are the \
         caller's."
            .to_owned(),
    ];
    let entries = [(input, input_docs), (torque, torque_docs)];
    let entries = entries.map(|(program, docs)| entry(program.name().to_owned(), program, docs));
    Ok(entries.into())
}

fn map_entries(
    model: &ReducedModel,
    units: Units,
    latent: Option<&LatentUnits>,
) -> Result<Vec<FunctionSpec>, LowerError> {
    let (state, input) = match units {
        Units::Si => (model.state(), model.input()),
        // Their units are those of SI values.
        Units::Scaled => (None, None),
    };
    let unit = units.of_robot();
    let n = format!("robot coordinates in {unit}");
    let is_nonlinear = [model.encoder_map(), model.decoder_map()]
        .map(|map| map.is_ok_and(|map| map.as_affine().is_none()));
    let positions = in_units("z", latent.map(|units| &units.position));
    let velocities = latent.map_or("(scaled)", |_| "(in the units of z per second)");
    let inputs = in_units("u_lat", latent.map(|units| &units.input));
    let [at_x, at_z] = points(is_nonlinear);
    let (of_x, of_u) = (elements("x", state), elements("u", input));
    let mut entries = Vec::new();
    for (map, title) in Map::ALL.into_iter().zip(titles(is_nonlinear)) {
        let text = match map {
            Map::Encode => format!("x: {n}. z: latent coordinates {positions}.{of_x}"),
            Map::EncodeVelocity => {
                format!("{at_x}dx: velocities of the {n}. dz: latent velocities {velocities}.")
            }
            Map::Decode => format!("z: latent coordinates {positions}. x: {n}.{of_x}"),
            Map::DecodeVelocity => {
                format!("{at_z}dz: latent velocities {velocities}. dx: velocities of the {n}.")
            }
            Map::ProjectInput => format!(
                "{at_x}u: generalised inputs in {unit}. u_lat: latent inputs {inputs}.{of_u}"
            ),
            Map::LiftInput => format!(
                "{at_x}u_lat: latent inputs {inputs}. u: generalised inputs in {unit}.{of_u}"
            ),
        };
        let program = match (map, latent) {
            (Map::ProjectInput, Some(units)) => map.of_weights(&units.project),
            (Map::LiftInput, Some(units)) => map.of_weights(&units.lift),
            (Map::ProjectInput | Map::LiftInput, None)
            | (Map::Encode | Map::EncodeVelocity | Map::Decode | Map::DecodeVelocity, _) => {
                map.lower(model)
            }
        };
        match program {
            Ok(program) => {
                let title = match (latent, units) {
                    (None, Units::Si) => title.to_owned(),
                    (Some(_), _) => in_matrices(title),
                    (None, Units::Scaled) => without_factors(title),
                };
                let docs = vec![title, text];
                entries.push(entry(program.name().to_owned(), program, docs));
            }
            Err(LowerError::Model(ModelError::Missing { .. })) => {}
            Err(error) => return Err(error),
        }
    }
    Ok(entries)
}

/// "(scaled)", or the units of each element.
fn in_units(array: &str, units: Option<&Vec<Unit>>) -> String {
    let Some(units) = units else {
        return "(scaled)".to_owned();
    };
    let elements = (units.iter().enumerate()).map(|(k, unit)| format!("{array}[{k}] {unit}"));
    format!("({})", elements.collect::<Vec<_>>().join(", "))
}

fn phase_entries(
    system: &Equations<'_>,
    phase: usize,
    form: Form,
) -> Result<PhaseInterface, LowerError> {
    let identifier = system.model().phase_identifier(phase).to_string();
    let equations = equations(system, phase)?;
    let name = &system.phase(phase)?.name;

    let program = lower::dynamics(system, phase, form)?;
    let mut docs = vec![format!(
        "Latent accelerations of phase `{name}`: ddz = Xi^T Theta(z, dz, u_lat), {}.",
        match system.latent_units() {
            None => "scaled units",
            Some(_) => "in the units of z per s^2",
        }
    )];
    docs.extend(equations);
    let dynamics = entry(format!("{identifier}_dynamics"), program, docs);

    let (program, pattern) = lower::dynamics_jacobian(system, phase, form)?;
    let docs = vec![format!(
        "Latent accelerations of phase `{name}` and the structural nonzeros of their \
         Jacobian d ddz / d (z, dz, u_lat), row-major."
    )];
    let mut jacobian = entry(format!("{identifier}_dynamics_jacobian"), program, docs);
    if pattern.is_empty() {
        jacobian.parameters.push(Parameter {
            name: "jacobian".to_owned(),
            len: 0,
            role: Role::Output,
        });
    }

    let program = lower::rk4_step(system, phase, form)?;
    let docs = vec![format!(
        "Advances the latent state of phase `{name}` by h seconds: one step of the classical \
         Runge-Kutta method with u_lat held."
    )];
    Ok(PhaseInterface {
        step: entry(format!("{identifier}_step"), program, docs),
        identifier,
        dynamics,
        jacobian,
        pattern,
    })
}

/// An entry whose outputs of the same name as an input are updated in place; its documentation ends
/// with the lengths of all arrays.
fn entry(name: String, program: Program, mut docs: Vec<String>) -> FunctionSpec {
    docs.push(shapes(&program));
    let is_in = |slots: &[Slot], name: &str| slots.iter().any(|slot| slot.name == name);
    let parameter = |slot: &Slot, role| Parameter {
        name: slot.name.clone(),
        len: slot.len,
        role,
    };
    let inputs = program
        .inputs()
        .iter()
        .map(|slot| match slot.name.as_str() {
            name if is_in(program.outputs(), name) => parameter(slot, Role::InOut),
            "h" => parameter(slot, Role::Scalar),
            _ => parameter(slot, Role::Input),
        });
    let outputs = program.outputs().iter();
    let written = outputs.filter(|slot| !is_in(program.inputs(), &slot.name));
    let written = written.map(|slot| parameter(slot, Role::Output));
    let parameters = inputs.chain(written).collect();
    FunctionSpec {
        name,
        program,
        parameters,
        docs,
    }
}

/// "Lengths: z 2, dz 2, u_lat 2, ddz 2."
fn shapes(program: &Program) -> String {
    let mut names: Vec<String> = Vec::new();
    for slot in program.inputs().iter().chain(program.outputs()) {
        let text = format!("{} {}", slot.name, slot.len);
        if slot.name != "h" && !names.contains(&text) {
            names.push(text);
        }
    }
    format!("Lengths: {}.", names.join(", "))
}

/// " `x[0]` fr.hx (rad), ..." if the model names its coordinates.
fn elements(array: &str, signals: Option<&CoordinateNames>) -> String {
    let Some(signals) = signals else {
        return String::new();
    };
    let pairs = signals.names.iter().zip(&signals.units).enumerate();
    let list: Vec<String> = pairs
        .map(|(k, (name, unit))| format!("{array}[{k}] {name} ({unit})"))
        .collect();
    format!(" {}.", list.join(", "))
}

/// The equations of a phase, one line each; long ones only as a count of terms.
fn equations(system: &Equations<'_>, phase: usize) -> Result<Vec<String>, LowerError> {
    let mut lines = Vec::new();
    let of_phase = system.phase(phase)?;
    for row in 0..system.latent_dim() {
        let terms: Vec<_> = of_phase.summands(system, row).collect();
        let mut right = String::new();
        for (coefficient, term) in terms.iter().take(MOST_TERMS) {
            let sign = match (right.is_empty(), *coefficient < 0.0) {
                (true, false) => "",
                (true, true) => "-",
                (false, false) => " + ",
                (false, true) => " - ",
            };
            right.push_str(sign);
            right.push_str(&summand_words(coefficient.abs(), term.text()));
        }
        let right = match terms.len() {
            0 => "0".to_owned(),
            1..=MOST_TERMS => right,
            count => format!("a sum of {count} terms"),
        };
        lines.push(format!("ddz{} = {right}", row + 1));
        if let Some(units) = system
            .latent_units()
            .filter(|_| (1..=MOST_TERMS).contains(&terms.len()))
        {
            let pool = system.pool();
            let of =
                |term: &CandidateTerm| units.acceleration(row) / units.of_term(pool, term.expr());
            let each = terms
                .iter()
                .map(|(_, term)| format!("{} {}", term.text(), of(term)));
            let each = each.collect::<Vec<_>>().join(", ");
            lines.push(format!(
                "Units of the coefficients of ddz{}: {each}.",
                row + 1
            ));
        }
    }
    Ok(lines)
}
