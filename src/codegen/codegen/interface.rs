//! The generated functions of a model: programs, with names, roles and documentation.

use super::documentation::{equations, of_coordinates, of_inputs, of_maps};
use super::*;
use crate::lower;

#[derive(Clone, Debug)]
pub(crate) struct FunctionSpec {
    pub name: String,
    pub program: Program,
    pub parameters: Vec<Parameter<String>>,
    pub docs: Vec<String>,
}

#[derive(Clone, Debug)]
pub struct PhaseInterface {
    pub identifier: String,
    pub(crate) dynamics: FunctionSpec,
    pub(crate) jacobian: FunctionSpec,
    pub pattern: JacobianPattern,
    pub(crate) step: FunctionSpec,
}

#[derive(Clone, Debug)]
pub struct ModelInterface {
    pub identifier: String,
    pub name: String,
    pub units: Units,
    /// Whether latent quantities are in physical units instead of the model's scaled ones.
    pub is_physical: bool,
    pub latent_dim: usize,
    /// Lines of the documentation with quantity and unit of each latent coordinate; empty if unknown.
    pub latent_lines: Vec<String>,
    /// Number of robot coordinates, if the model has any.
    pub state_dim: Option<usize>,
    pub(crate) maps: Vec<FunctionSpec>,
    pub phases: Vec<PhaseInterface>,
}

impl ModelInterface {
    pub fn new(system: &Equations<'_>, form: Form, units: Units) -> Result<Self, LowerError> {
        let model = &units.convert(&system.model)?;
        let phases = (0..model.phases().len())
            .map(|phase| phase_entries(system, phase, form))
            .collect::<Result<_, _>>()?;
        Ok(Self {
            identifier: model.identifier().to_string(),
            name: model.name().to_owned(),
            units,
            is_physical: system.latent_units().is_some(),
            latent_dim: model.latent_dim(),
            latent_lines: of_coordinates(system),
            state_dim: model.state_dim(),
            maps: match units {
                Units::Si => {
                    let inputs = input_entries(model)?;
                    [inputs, map_entries(model, units, system.latent_units())?].concat()
                }
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

/// Functions for the maps' input and motor torques from it; none unless the model has a known robot's coordinates.
fn input_entries(model: &ReducedModel) -> Result<Vec<FunctionSpec>, LowerError> {
    let (Some(input), Some(torque)) = (
        lower::generalised_input(model)?,
        lower::actuator_torque(model)?,
    ) else {
        return Ok(Vec::new());
    };
    let [of_input, of_torque, of_legs] = of_inputs(model)?;
    let mut entries = vec![
        entry("generalised_input", input, of_input),
        entry("actuator_torque", torque, of_torque),
    ];
    entries.extend(lower::leg_torque(model)?.map(|legs| entry("leg_torque", legs, of_legs)));
    Ok(entries)
}

fn map_entries(
    model: &ReducedModel,
    units: Units,
    latent: Option<&LatentUnits>,
) -> Result<Vec<FunctionSpec>, LowerError> {
    let mut entries = Vec::new();
    for (map, docs) in Map::ALL.into_iter().zip(of_maps(model, units, latent)) {
        let program = match (map, latent) {
            (Map::ProjectInput, Some(units)) => map.of_weights(&units.project),
            (Map::LiftInput, Some(units)) => map.of_weights(&units.lift),
            _ => map.lower(model),
        };
        match program {
            Ok(program) => {
                let name = program.name.clone();
                entries.push(entry(&name, program, docs));
            }
            Err(LowerError::Model(ModelError::Missing { .. })) => {}
            Err(error) => return Err(error),
        }
    }
    Ok(entries)
}

fn phase_entries(
    system: &Equations<'_>,
    phase: usize,
    form: Form,
) -> Result<PhaseInterface, LowerError> {
    let identifier = system.model.phase_identifier(phase).to_string();
    let name = &system.phase(phase)?.name;
    let units = match system.latent_units() {
        None => "scaled units",
        Some(_) => "in the units of z per s^2",
    };
    let mut docs = vec![format!(
        "Latent accelerations of phase `{name}`: ddz = Xi^T Theta(z, dz, u_lat), {units}."
    )];
    docs.extend(equations(system, phase)?);
    let program = lower::dynamics(system, phase, form)?;
    let dynamics = entry(&format!("{identifier}_dynamics"), program, docs);

    let (program, pattern) = lower::dynamics_jacobian(system, phase, form)?;
    let docs = vec![format!(
        "Latent accelerations of phase `{name}` and the structural nonzeros of their \
         Jacobian d ddz / d (z, dz, u_lat), row-major."
    )];
    let mut jacobian = entry(&format!("{identifier}_dynamics_jacobian"), program, docs);
    if pattern.is_empty() {
        jacobian.parameters.push(Parameter {
            name: "jacobian".to_owned(),
            len: 0,
            role: Role::Output,
        });
    }

    let docs = vec![format!(
        "Advances the latent state of phase `{name}` by h seconds: one step of the classical \
         Runge-Kutta method with u_lat held."
    )];
    let program = lower::rk4_step(system, phase, form)?;
    Ok(PhaseInterface {
        step: entry(&format!("{identifier}_step"), program, docs),
        identifier,
        dynamics,
        jacobian,
        pattern,
    })
}

/// Outputs named as an input are updated in place; the documentation ends with the lengths of all arrays.
fn entry(name: &str, program: Program, mut docs: Vec<String>) -> FunctionSpec {
    let mut parameters: Vec<Parameter<String>> = Vec::new();
    let inputs = program.inputs.iter().map(|slot| (slot, Role::Input));
    let outputs = program.outputs.iter().map(|slot| (slot, Role::Output));
    for (slot, role) in inputs.chain(outputs) {
        match parameters.iter_mut().find(|known| known.name == slot.name) {
            Some(known) => known.role = Role::InOut,
            None => parameters.push(Parameter {
                name: slot.name.clone(),
                len: slot.len,
                role: if slot.name == "h" { Role::Scalar } else { role },
            }),
        }
    }
    let lengths = parameters.iter().filter(|p| p.role != Role::Scalar);
    let lengths: Vec<String> = lengths.map(|p| format!("{} {}", p.name, p.len)).collect();
    docs.push(format!("Lengths: {}.", lengths.join(", ")));
    FunctionSpec {
        name: name.to_owned(),
        program,
        parameters,
        docs,
    }
}
