//! The use of each tensor: as mapped, else by its name.

use super::error::ImportError;
use super::names;
use super::options::{ImportOptions, PhaseRule, no_feet};
use super::report::Chosen;
use super::role::{Part, Role};
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

/// A tensor whose name suggests a use.
type Suggestion<'f> = (Role, &'f TensorInfo);

/// Decides for the whole file.
pub(super) fn assign<'f>(
    tensors: &'f TensorFile<'_>,
    options: &ImportOptions,
) -> Result<Assignment<'f>, ImportError> {
    let mut used = mapped(tensors, options)?;
    let free = |info: &&TensorInfo| used.iter().all(|a| a.info.name != info.name);
    let suggested: Vec<Suggestion<'_>> = (tensors.infos().iter().filter(free))
        .filter_map(|info| Some((named(&info.name)?, info)))
        .collect();
    let phases = phases(tensors, options, &used, &suggested)?;
    check_mapped_phases(options, &phases)?;
    if options.activation.is_some() {
        for part in [Part::Encoder, Part::Decoder] {
            let layers = layers(part, &used, &suggested);
            used.extend(layers);
        }
    }
    for role in roles(options, &phases) {
        let is_given = used
            .iter()
            .any(|assigned| match (&role, assigned.role.layer()) {
                (Role::Weights(part) | Role::Bias(part), Some((layered, _))) => layered == *part,
                _ => assigned.role == role,
            });
        if !is_given && let Some(info) = only_candidate(tensors, &role, &phases, &suggested)? {
            let chosen = Chosen::Guessed;
            used.push(Assigned { role, info, chosen });
        }
    }
    used.sort_by(|a, b| a.role.cmp(&b.role));
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

/// The use that a name suggests: one of the usual names, or exactly that of a part.
fn named(name: &str) -> Option<Role> {
    names::role_of(name).or_else(|| name.parse().ok())
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
            return Err(ImportError::option("--map", found, "one tensor"));
        }
        let Some(info) = tensors.infos().iter().find(|info| info.name == *tensor) else {
            let found = format!("no tensor `{tensor}` for {role}");
            let expected = format!("one of {}", tensors.listing());
            return Err(ImportError::at(
                tensors.file(),
                Place::Whole,
                found,
                expected,
            ));
        };
        let (role, chosen) = (role.clone(), Chosen::Mapped);
        used.push(Assigned { role, info, chosen });
    }
    Ok(used)
}

/// The phases of the model: those given, or those whose coefficients the file has.
fn phases(
    tensors: &TensorFile<'_>,
    options: &ImportOptions,
    used: &[Assigned<'_>],
    suggested: &[Suggestion<'_>],
) -> Result<Vec<PhaseRule>, ImportError> {
    if !options.phases.is_empty() {
        return Ok(options.phases.clone());
    }
    let mapped = used.iter().map(|assigned| (&assigned.role, assigned.info));
    let by_name = suggested.iter().map(|(role, info)| (role, *info));
    let (mut found, mut unnamed) = (Vec::<(&String, &TensorInfo)>::new(), None);
    for (role, info) in mapped.chain(by_name) {
        match role {
            Role::Xi(phase) if phase.is_empty() => unnamed = unnamed.or(Some(info)),
            Role::Xi(phase)
                if !found
                    .iter()
                    .any(|(name, _)| names::is_same_phase(phase, name)) =>
            {
                found.push((phase, info));
            }
            _ => {}
        }
    }
    // The rule `any` takes every pattern with a foot down, so the order of these two is free.
    found.sort_by_key(|(name, _)| *name);
    let coefficients = |info: &TensorInfo| format!("the coefficients {}", info.describe());
    match (found.is_empty(), unnamed) {
        (true, Some(info)) => {
            let found = coefficients(info) + ", perhaps";
            return Err(no_feet(tensors.file(), "contact", &found));
        }
        (true, None) => return Err(tensors.missing(&Role::Xi("PHASE".to_owned()))),
        (false, _) => {}
    }
    let rules = found.into_iter().map(|(name, info)| {
        let feet = options.feet_of(name);
        let feet = feet.ok_or_else(|| no_feet(tensors.file(), name, &coefficients(info)))?;
        let name = name.clone();
        Ok(PhaseRule { name, feet })
    });
    rules.collect()
}

/// Refuses `--map` for a phase that is not there.
fn check_mapped_phases(options: &ImportOptions, phases: &[PhaseRule]) -> Result<(), ImportError> {
    let is_strange = |role: &&Role| {
        (role.phase()).is_some_and(|phase| phases.iter().all(|rule| rule.name != phase))
    };
    match options
        .mapping
        .iter()
        .map(|mapping| &mapping.role)
        .find(is_strange)
    {
        None => Ok(()),
        Some(role) => {
            let names: Vec<&str> = phases.iter().map(|rule| rule.name.as_str()).collect();
            let found = format!("{role} for a phase that no --phase names");
            let expected = format!("one of the phases {}", names.join(", "));
            Err(ImportError::option("--map", found, expected))
        }
    }
}

/// Every part that a model with these phases can have; `--scaling` takes the place of tensors.
fn roles(options: &ImportOptions, phases: &[PhaseRule]) -> Vec<Role> {
    let mut roles = Vec::new();
    for part in [Part::Encoder, Part::Decoder] {
        roles.extend([Role::Weights(part), Role::Bias(part)]);
    }
    for PhaseRule { name, .. } in phases {
        let of_phase = [Role::Xi, Role::Mask, Role::InputMean, Role::InputCovariance];
        roles.extend(of_phase.map(|role| role(name.clone())));
    }
    if options.scaling.is_none() {
        roles.extend([Role::StateScaling, Role::InputScaling]);
    }
    roles
}

/// The layers of a map whose names differ in their numbers only, if there are several and nothing
/// is mapped.
fn layers<'f>(
    part: Part,
    used: &[Assigned<'f>],
    suggested: &[Suggestion<'f>],
) -> Vec<Assigned<'f>> {
    let is_mapped = |assigned: &Assigned<'_>| match assigned.role {
        Role::Weights(found) | Role::LayerWeights(found, _) => found == part,
        _ => false,
    };
    let of = |wanted: Role| {
        let fitting = suggested.iter().filter(|(role, _)| *role == wanted);
        let mut list: Vec<_> = fitting
            .map(|&(_, info)| (names::layer_of(&info.name), info))
            .collect();
        list.sort_by(|((_, a), _), ((_, b), _)| a.cmp(b));
        list
    };
    let (weights, biases) = (of(Role::Weights(part)), of(Role::Bias(part)));
    let is_network = |pair: &[_]| match pair {
        [((a, i), _), ((b, j), _)] => a == b && i != j,
        _ => false,
    };
    let mut layers = Vec::new();
    if used.iter().any(is_mapped) || weights.len() < 2 || !weights.windows(2).all(is_network) {
        return layers;
    }
    let chosen = Chosen::Guessed;
    for (number, ((_, numbers), info)) in weights.into_iter().enumerate() {
        let role = Role::LayerWeights(part, number);
        layers.push(Assigned { role, info, chosen });
        if let Some((_, info)) = biases.iter().find(|((_, found), _)| *found == numbers) {
            let role = Role::LayerBias(part, number);
            layers.push(Assigned { role, info, chosen });
        }
    }
    layers
}

/// The one tensor whose name suggests a role.
fn only_candidate<'f>(
    tensors: &TensorFile<'_>,
    role: &Role,
    phases: &[PhaseRule],
    suggested: &[Suggestion<'f>],
) -> Result<Option<&'f TensorInfo>, ImportError> {
    let fits = |found: &Role| match (found.phase(), role.phase()) {
        (Some(found_phase), Some(phase)) => {
            std::mem::discriminant(found) == std::mem::discriminant(role)
                && (names::is_same_phase(found_phase, phase)
                    || (found_phase.is_empty() && phases.len() == 1))
        }
        _ => found == role,
    };
    let candidates: Vec<&'f TensorInfo> = (suggested.iter())
        .filter(|(found, info)| fits(found) || info.name == role.to_string())
        .map(|&(_, info)| info)
        .collect();
    let [first, second, ..] = candidates[..] else {
        return Ok(candidates.first().copied());
    };
    let texts: Vec<String> = candidates.iter().map(|info| info.describe()).collect();
    let are_layers = names::layer_of(&first.name).0 == names::layer_of(&second.name).0;
    Err(match role {
        Role::Weights(part) | Role::Bias(part) if are_layers => {
            deeper(tensors.file(), *part, &texts)
        }
        _ => {
            let found = format!("{} for {role}", texts.join(", "));
            let expected = format!("one: name it with --map {role}=TENSOR");
            ImportError::at(tensors.file(), Place::Whole, found, expected)
        }
    })
}

/// Layers without `--activation`.
pub(super) fn deeper(file: &str, part: Part, layers: &[String]) -> ImportError {
    let found = format!(
        "{}, the layers of a deeper {}",
        layers.join(", "),
        part.name()
    );
    let expected = "one linear layer, or --activation elu, tanh or sigmoid to say what is between \
                    them";
    ImportError::at(file, Place::Whole, found, expected)
}
