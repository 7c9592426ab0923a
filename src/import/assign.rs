//! Decides which tensor is used as what: first as mapped, then by usual names.

use super::error::ImportError;
use super::names::{self, Guess};
use super::options::{ImportOptions, PhaseRule};
use super::report::Chosen;
use super::role::{Part, Role};
use super::tensors::{TensorFile, TensorInfo};

/// A tensor and its use.
#[derive(Clone, Debug)]
pub(super) struct Assigned<'f> {
    pub(super) role: Role,
    pub(super) info: &'f TensorInfo,
    pub(super) chosen: Chosen,
}

/// All decisions about a file.
#[derive(Debug)]
pub(super) struct Assignment<'f> {
    pub(super) phases: Vec<PhaseRule>,
    pub(super) used: Vec<Assigned<'f>>,
    pub(super) unused: Vec<&'f TensorInfo>,
}

impl<'f> Assignment<'f> {
    /// The tensor of a role, if there is one.
    pub(super) fn find(&self, role: &Role) -> Option<&Assigned<'f>> {
        self.used.iter().find(|assigned| assigned.role == *role)
    }
}

/// Decides for the whole file.
///
/// # Errors
/// [`ImportError::NoTensor`], [`ImportError::Missing`], [`ImportError::Candidates`],
/// [`ImportError::Layers`], [`ImportError::NoFeet`], [`ImportError::Option`].
pub(super) fn assign<'f>(
    tensors: &'f TensorFile<'_>,
    options: &ImportOptions,
) -> Result<Assignment<'f>, ImportError> {
    let mut used = mapped(tensors, options)?;
    let guesses: Vec<(Guess, &TensorInfo)> = (tensors.infos().iter())
        .filter(|info| used.iter().all(|assigned| assigned.info.name != info.name))
        .filter_map(|info| Some((names::guess(&info.name)?, info)))
        .collect();
    let phases = phases(tensors, options, &used, &guesses)?;
    check_mapped_phases(options, &phases)?;

    let mut guessed = Vec::new();
    if options.activation.is_some() {
        for part in [Part::Encoder, Part::Decoder] {
            guessed.extend(layers(part, &used, &guesses));
        }
    }
    let has_layers = |part: Part, lists: [&[Assigned<'_>]; 2]| {
        lists
            .into_iter()
            .flatten()
            .any(|assigned| matches!(assigned.role, Role::LayerWeights(found, _) if found == part))
    };
    for role in roles(&phases) {
        let layered = match role {
            Role::Weights(part) | Role::Bias(part) => has_layers(part, [&used, &guessed]),
            _ => false,
        };
        if layered {
            continue;
        }
        if used.iter().any(|assigned| assigned.role == role) {
            continue;
        }
        if let Some(info) = only_candidate(tensors, &role, &phases, &guesses)? {
            guessed.push(Assigned {
                role,
                info,
                chosen: Chosen::Guessed,
            });
        }
    }
    used.extend(guessed);
    used.sort_by(|a, b| a.role.cmp(&b.role));
    for phase in &phases {
        let role = Role::Xi(phase.name.clone());
        if used.iter().all(|assigned| assigned.role != role) {
            return Err(missing(tensors, &role));
        }
    }
    let is_used = |info: &TensorInfo| used.iter().any(|assigned| assigned.info.name == info.name);
    let unused = (tensors.infos().iter())
        .filter(|info| !is_used(info))
        .collect();
    Ok(Assignment {
        phases,
        used,
        unused,
    })
}

fn missing(tensors: &TensorFile<'_>, role: &Role) -> ImportError {
    ImportError::Missing {
        file: tensors.file().to_owned(),
        role: role.to_string(),
        available: tensors.listing(),
    }
}

/// What `--map` says.
fn mapped<'f>(
    tensors: &'f TensorFile<'_>,
    options: &ImportOptions,
) -> Result<Vec<Assigned<'f>>, ImportError> {
    let mut used: Vec<Assigned<'f>> = Vec::new();
    for mapping in &options.mapping {
        if let Some(earlier) = used.iter().find(|assigned| assigned.role == mapping.role) {
            return Err(ImportError::Option {
                option: "--map",
                found: format!(
                    "both `{}` and `{}` for {}",
                    earlier.info.name, mapping.tensor, mapping.role
                ),
                expected: "one tensor".to_owned(),
            });
        }
        let info = tensors
            .find(&mapping.tensor)
            .ok_or_else(|| ImportError::NoTensor {
                file: tensors.file().to_owned(),
                role: mapping.role.to_string(),
                tensor: mapping.tensor.clone(),
                available: tensors.listing(),
            })?;
        used.push(Assigned {
            role: mapping.role.clone(),
            info,
            chosen: Chosen::Mapped,
        });
    }
    Ok(used)
}

/// The phases of the model: those given, or those whose coefficients the file has.
fn phases(
    tensors: &TensorFile<'_>,
    options: &ImportOptions,
    used: &[Assigned<'_>],
    guesses: &[(Guess, &TensorInfo)],
) -> Result<Vec<PhaseRule>, ImportError> {
    if !options.phases.is_empty() {
        return Ok(options.phases.clone());
    }
    let mut found: Vec<(String, &TensorInfo)> = (used.iter())
        .filter_map(|assigned| match &assigned.role {
            Role::Xi(phase) => Some((phase.clone(), assigned.info)),
            _ => None,
        })
        .collect();
    for (guess, info) in guesses {
        match guess {
            // A name without a phase fits none while there are no phases to choose from.
            Guess::Xi(words) if words.is_empty() => {}
            Guess::Xi(words) if !found.iter().any(|(name, _)| names::name_phase(words, name)) => {
                found.push((words.join("_"), info));
            }
            _ => {}
        }
    }
    // The rule `any` takes every pattern with a foot down, so the order of these two is free.
    found.sort_by_key(|(name, _)| name.clone());
    let mut phases = Vec::new();
    for (name, info) in found {
        match options.feet_of(&name) {
            Some(feet) => phases.push(PhaseRule { name, feet }),
            None => {
                return Err(ImportError::NoFeet {
                    file: tensors.file().to_owned(),
                    phase: name,
                    found: format!("the coefficients {}", info.describe()),
                });
            }
        }
    }
    if phases.is_empty() {
        let unnamed = guesses
            .iter()
            .find(|(guess, _)| matches!(guess, Guess::Xi(_)));
        return Err(match unnamed {
            Some((_, info)) => ImportError::NoFeet {
                file: tensors.file().to_owned(),
                phase: "contact".to_owned(),
                found: format!("the coefficients {}, perhaps", info.describe()),
            },
            None => missing(tensors, &Role::Xi("PHASE".to_owned())),
        });
    }
    Ok(phases)
}

/// Complains about `--map` for a phase that is not there.
fn check_mapped_phases(options: &ImportOptions, phases: &[PhaseRule]) -> Result<(), ImportError> {
    for mapping in &options.mapping {
        let Some(phase) = mapping.role.phase() else {
            continue;
        };
        if phases.iter().all(|rule| rule.name != phase) {
            let names: Vec<&str> = phases.iter().map(|rule| rule.name.as_str()).collect();
            return Err(ImportError::Option {
                option: "--map",
                found: format!("{} for a phase that no --phase names", mapping.role),
                expected: format!("one of the phases {}", names.join(", ")),
            });
        }
    }
    Ok(())
}

/// Everything that a model with these phases can be made of.
fn roles(phases: &[PhaseRule]) -> Vec<Role> {
    let mut roles = Vec::new();
    for part in [Part::Encoder, Part::Decoder] {
        roles.extend([Role::Weights(part), Role::Bias(part)]);
    }
    for PhaseRule { name, .. } in phases {
        let of_phase = [Role::Xi, Role::Mask, Role::InputMean, Role::InputCovariance];
        roles.extend(of_phase.map(|role| role(name.clone())));
    }
    roles
}

/// The layers of a map whose names differ in their numbers only, if there are several and nothing
/// is mapped.
fn layers<'f>(
    part: Part,
    used: &[Assigned<'f>],
    guesses: &[(Guess, &'f TensorInfo)],
) -> Vec<Assigned<'f>> {
    let is_mapped = used.iter().any(|assigned| match assigned.role {
        Role::Weights(found) | Role::LayerWeights(found, _) => found == part,
        _ => false,
    });
    let of = |wanted: Guess| -> Vec<(Vec<u64>, &'f TensorInfo)> {
        let fitting = guesses.iter().filter(|(guess, _)| *guess == wanted);
        let mut list: Vec<_> = fitting
            .map(|&(_, info)| (names::numbers(&info.name), info))
            .collect();
        list.sort_by(|a, b| a.0.cmp(&b.0));
        list
    };
    let weights = of(Guess::Weights(part));
    let one_network = |pair: &[(Vec<u64>, &TensorInfo)]| {
        pair[0].0 != pair[1].0 && names::are_layers(&pair[0].1.name, &pair[1].1.name)
    };
    if is_mapped || weights.len() < 2 || !weights.windows(2).all(one_network) {
        return Vec::new();
    }
    let biases = of(Guess::Bias(part));
    let mut list = Vec::new();
    for (layer, (numbers, info)) in weights.iter().enumerate() {
        let assigned = |role, info| Assigned {
            role,
            info,
            chosen: Chosen::Guessed,
        };
        list.push(assigned(Role::LayerWeights(part, layer), *info));
        if let Some((_, bias)) = biases.iter().find(|(found, _)| found == numbers) {
            list.push(assigned(Role::LayerBias(part, layer), *bias));
        }
    }
    list
}

/// The one tensor whose name suggests a role.
fn only_candidate<'f>(
    tensors: &TensorFile<'_>,
    role: &Role,
    phases: &[PhaseRule],
    guesses: &[(Guess, &'f TensorInfo)],
) -> Result<Option<&'f TensorInfo>, ImportError> {
    let names_phase = |words: &[String], phase: &str| {
        names::name_phase(words, phase) || (words.is_empty() && phases.len() == 1)
    };
    let fits = |guess: &Guess| match (guess, role) {
        (Guess::Weights(found), Role::Weights(part)) => found == part,
        (Guess::Bias(found), Role::Bias(part)) => found == part,
        (Guess::Xi(words), Role::Xi(phase))
        | (Guess::Mask(words), Role::Mask(phase))
        | (Guess::InputMean(words), Role::InputMean(phase))
        | (Guess::InputCovariance(words), Role::InputCovariance(phase)) => {
            names_phase(words, phase)
        }
        _ => false,
    };
    let candidates: Vec<&'f TensorInfo> = (guesses.iter())
        .filter(|(guess, _)| fits(guess))
        .map(|&(_, info)| info)
        .collect();
    match candidates.as_slice() {
        [] => Ok(None),
        [only] => Ok(Some(only)),
        [first, second, ..] => {
            let texts: Vec<String> = candidates.iter().map(|info| info.describe()).collect();
            let found = texts.join(", ");
            let file = tensors.file().to_owned();
            let layers = names::are_layers(&first.name, &second.name);
            Err(match role {
                Role::Weights(part) | Role::Bias(part) if layers => ImportError::Layers {
                    file,
                    part: part.name(),
                    found,
                },
                _ => ImportError::Candidates {
                    file,
                    role: role.to_string(),
                    found,
                },
            })
        }
    }
}
