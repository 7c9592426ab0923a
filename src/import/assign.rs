//! The use of each tensor: as mapped, else by its name.

use super::error::{ImportError, ImportFault};
use super::options::{ImportOptions, PhaseRule};
use super::report::Chosen;
use super::role::{ONLY_PHASE, Role};
use super::tensors::{TensorFile, TensorInfo};
use crate::files::Place;

/// A tensor and its use.
#[derive(Clone, Debug)]
pub(super) struct Assigned<'f> {
    pub(super) role: Role,
    pub(super) info: &'f TensorInfo,
    pub(super) chosen: Chosen,
}

impl Assigned<'_> {
    /// The tensor as the place of a fault, or the number of it at an index of the file.
    pub(super) fn place(&self, index: &[usize]) -> Place {
        let (name, role) = (&self.info.name, &self.role);
        Place::Entry(match index {
            [] => format!("`{name}` as {role}").into(),
            _ => format!("`{name}`{index:?} as {role}").into(),
        })
    }
}

/// All decisions about a file.
pub(super) struct Assignment<'f> {
    pub(super) phases: Vec<PhaseRule>,
    pub(super) used: Vec<Assigned<'f>>,
    pub(super) unused: Vec<&'f TensorInfo>,
}

/// Decides for the whole file.
pub(super) fn assign<'f>(
    tensors: &'f TensorFile<'_>,
    options: &ImportOptions,
) -> Result<Assignment<'f>, ImportError> {
    let mut used = mapped(tensors, options)?;
    used.extend(named(tensors, options, &used)?);
    used.sort_by(|a, b| a.role.cmp(&b.role));
    let phases = phases(tensors, options, &used)?;
    check_mapped_phases(options, &phases)?;
    let is_known = |phase: &str| phases.iter().any(|rule| rule.name == phase);
    used.retain(|assigned| assigned.role.phase().is_none_or(is_known));
    for phase in &phases {
        let role = Role::Xi(phase.name.clone());
        if used.iter().all(|assigned| assigned.role != role) {
            return Err(tensors.missing(&role));
        }
    }
    let is_unused = |info: &&TensorInfo| used.iter().all(|a| a.info.name != info.name);
    Ok(Assignment {
        phases,
        unused: tensors.infos().iter().filter(is_unused).collect(),
        used,
    })
}

/// The tensors with names of parts that `--map` does not settle: it settles all weights of a map at once. Factors beside
/// `--scaling` are not settled: they are refused.
fn named<'f>(
    tensors: &'f TensorFile<'_>,
    options: &ImportOptions,
    mapped: &[Assigned<'_>],
) -> Result<Vec<Assigned<'f>>, ImportError> {
    let is_settled = |role: &Role| {
        mapped.iter().any(|assigned| match (&assigned.role, role) {
            (Role::Weights(a, _), Role::Weights(b, _)) => a == b,
            (a, b) => a == b,
        })
    };
    let mut named: Vec<Assigned<'f>> = Vec::new();
    for info in tensors.infos() {
        let is_free = mapped.iter().all(|a| a.info.name != info.name);
        let role = Role::of_name(&info.name).filter(|role| is_free && !is_settled(role));
        let Some(role) = role.map(|role| renamed(role, options)) else {
            continue;
        };
        if let Some(earlier) = named.iter().find(|assigned| assigned.role == role) {
            let (a, b) = (earlier.info.describe(), info.describe());
            let found = format!("{a}, {b} for {role}");
            let expected = format!("one: name it with --map {role}=TENSOR");
            return Err(tensors.refused(Place::Whole, found, expected));
        }
        let chosen = Chosen::Named;
        named.push(Assigned { role, info, chosen });
    }
    Ok(named)
}

/// Coefficients without a phase belong to the only one there is.
fn renamed(role: Role, options: &ImportOptions) -> Role {
    match (role, options.phases.as_slice()) {
        (Role::Xi(phase), [only]) if phase == ONLY_PHASE => Role::Xi(only.name.clone()),
        (role, _) => role,
    }
}

/// The tensors of `--map`.
fn mapped<'f>(
    tensors: &'f TensorFile<'_>,
    options: &ImportOptions,
) -> Result<Vec<Assigned<'f>>, ImportError> {
    let mut used: Vec<Assigned<'f>> = Vec::new();
    for mapping in &options.mapping {
        let (role, tensor) = (&mapping.role, &mapping.tensor);
        if let Some(earlier) = used.iter().find(|assigned| assigned.role == *role) {
            let found = format!("both `{}` and `{tensor}` for {role}", earlier.info.name);
            return Err(ImportFault::option("--map", found, "one tensor"));
        }
        let Some(info) = tensors.infos().iter().find(|info| info.name == *tensor) else {
            let found = format!("no tensor `{tensor}` for {role}");
            let expected = format!("one of {}", tensors.listing());
            return Err(tensors.refused(Place::Whole, found, expected));
        };
        let (role, chosen) = (role.clone(), Chosen::Mapped);
        used.push(Assigned { role, info, chosen });
    }
    Ok(used)
}

/// The phases of the model: those given, then the others whose coefficients the file has.
fn phases(
    tensors: &TensorFile<'_>,
    options: &ImportOptions,
    used: &[Assigned<'_>],
) -> Result<Vec<PhaseRule>, ImportError> {
    let mut rules = options.phases.clone();
    // Sorted by name; the rule `any` takes every pattern with a foot down, so that the order of the
    // two known phases is free.
    for assigned in used {
        if let Role::Xi(name) = &assigned.role
            && options.given(name).is_none()
        {
            let found = format!("the coefficients {}", assigned.info.describe());
            let feet = options.feet_of(tensors.file(), name, &found)?;
            let name = name.clone();
            rules.push(PhaseRule { name, feet });
        }
    }
    match rules.is_empty() {
        true => Err(tensors.missing(&Role::Xi("PHASE".to_owned()))),
        false => Ok(rules),
    }
}

/// Refuses `--map` for a phase that is not there.
fn check_mapped_phases(options: &ImportOptions, phases: &[PhaseRule]) -> Result<(), ImportError> {
    let is_strange = |role: &&Role| {
        (role.phase()).is_some_and(|phase| phases.iter().all(|rule| rule.name != phase))
    };
    let mut roles = options.mapping.iter().map(|mapping| &mapping.role);
    match roles.find(is_strange) {
        None => Ok(()),
        Some(role) => {
            let names: Vec<&str> = phases.iter().map(|rule| rule.name.as_str()).collect();
            let found = format!("{role} for a phase that no --phase names");
            let expected = format!("one of the phases {}", names.join(", "));
            Err(ImportFault::option("--map", found, expected))
        }
    }
}
