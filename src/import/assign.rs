//! The use of each tensor: as mapped, else by its name.

use super::role::mentions;
use super::*;

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
        match index {
            [] => format!("`{name}` as {role}").into(),
            _ => format!("`{name}`{index:?} as {role}").into(),
        }
    }
}

pub(super) struct Assignment<'f> {
    pub(super) phases: Vec<PhasePattern>,
    pub(super) used: Vec<Assigned<'f>>,
    pub(super) unused: Vec<&'f TensorInfo>,
}

pub(super) fn assign<'f>(
    tensors: &'f TensorFile<'_>,
    options: &ImportOptions,
) -> Read<Assignment<'f>> {
    let mut used = mapped(tensors, options)?;
    used.extend(named(tensors, options, &used)?);
    used.sort_by(|a, b| a.role.cmp(&b.role));
    let phases = phases(tensors, options, &used)?;
    let is_unused = |info: &&TensorInfo| used.iter().all(|a| a.info.name != info.name);
    let unused: Vec<&TensorInfo> = tensors.infos.iter().filter(is_unused).collect();
    check_layers(tensors, options, &unused)?;
    let mut means = unused.iter();
    if let Some(mean) = means.find(|info| mentions(&info.name, "mean.input")) {
        let expected = "inputs divided by std.input alone, or a file without it: u_lat has no mean";
        return Err(tensors.refused(Place::Whole, mean.describe(), expected));
    }
    Ok(Assignment {
        phases,
        used,
        unused,
    })
}

/// The tensors with names of parts that `--map` does not settle: it settles all weights of a map at once.
fn named<'f>(
    tensors: &'f TensorFile<'_>,
    options: &ImportOptions,
    mapped: &[Assigned<'_>],
) -> Read<Vec<Assigned<'f>>> {
    let is_settled = |role: &Role| {
        mapped.iter().any(|assigned| match (&assigned.role, role) {
            (Role::Weights(a, _), Role::Weights(b, _)) => a == b,
            (a, b) => a == b,
        })
    };
    let free = (tensors.infos.iter()).filter(|i| mapped.iter().all(|a| a.info.name != i.name));
    let found =
        free.filter_map(|info| Some((info, renamed(Role::of_name(&info.name)?, info, options))));
    let found: Vec<(&TensorInfo, Role)> = found.collect();
    let roles = found.iter().map(|(_, role)| role);
    let roles = roles.chain(mapped.iter().map(|assigned| &assigned.role));
    let known = roles.filter(|role| matches!(role, Role::Xi(_)));
    let known: Vec<String> = known.filter_map(Role::phase).map(str::to_owned).collect();
    let mut named: Vec<Assigned<'f>> = Vec::new();
    for (info, role) in found {
        let role = in_phase(tensors, info, role, &known)?;
        if is_settled(&role) {
            continue;
        }
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

/// Coefficients without a phase belong to the one whose name their module has, or to the only one there is.
fn renamed(role: Role, info: &TensorInfo, options: &ImportOptions) -> Role {
    if role != Role::Xi(ONLY_PHASE.to_owned()) {
        return role;
    }
    let given = options.phases.iter().map(|rule| rule.name.as_str());
    let mut usual = given.chain(["contact", "flight"]);
    let mentioned = usual.find(|phase| mentions(&info.name, phase));
    match (mentioned, options.phases.as_slice()) {
        (Some(phase), _) => role.of_phase(phase),
        (None, [only]) => role.of_phase(&only.name),
        (None, _) => role,
    }
}

/// The role in a phase that has coefficients: its own, that whose name the tensor's has, or the only one.
fn in_phase(
    tensors: &TensorFile<'_>,
    info: &TensorInfo,
    role: Role,
    known: &[String],
) -> Read<Role> {
    let is_known = |phase: &str| known.is_empty() || known.iter().any(|name| name == phase);
    if role.phase().is_none_or(is_known) {
        return Ok(role);
    }
    let mentioned = known.iter().filter(|phase| mentions(&info.name, phase));
    match (mentioned.max_by_key(|phase| phase.len()), known) {
        (Some(phase), _) => Ok(role.of_phase(phase)),
        (None, [only]) if role.phase() == Some(ONLY_PHASE) => Ok(role.of_phase(only)),
        (None, _) => {
            let (part, known) = (role.of_phase("PHASE"), known.join(", "));
            let found = format!("{} for none of the phases {known}", info.describe());
            let expected = format!("--map {part}={}, or a file without it", info.name);
            Err(tensors.refused(Place::Whole, found, expected))
        }
    }
}

/// Refuses a tensor of an encoder or decoder that is no layer's weight or bias, unless `--map` names the weights.
fn check_layers(
    tensors: &TensorFile<'_>,
    options: &ImportOptions,
    unused: &[&TensorInfo],
) -> Read<()> {
    let is_mapped = |part: Part| {
        let mut mapped = options.mapping.iter();
        mapped.any(|mapping| matches!(mapping.role, Role::Weights(of, _) if of == part))
    };
    for part in Part::ALL.into_iter().filter(|part| !is_mapped(*part)) {
        let mut strays = unused.iter().filter(|info| part.holds(&info.name));
        if let Some(stray) = strays.find(|info| !is_of_optimiser(&info.name)) {
            let part = part.name();
            let found = format!("{} in the {part}", stray.describe());
            let expected = format!(
                "weights and biases of linear layers alone (a normalisation folded into them), or the weights named \
                 with --map {part}.weight=TENSOR"
            );
            return Err(tensors.refused(Place::Whole, found, expected));
        }
    }
    Ok(())
}

fn mapped<'f>(tensors: &'f TensorFile<'_>, options: &ImportOptions) -> Read<Vec<Assigned<'f>>> {
    let mut used: Vec<Assigned<'f>> = Vec::new();
    for mapping in &options.mapping {
        let (role, tensor) = (&mapping.role, &mapping.tensor);
        if let Some(earlier) = used.iter().find(|assigned| assigned.role == *role) {
            let found = format!("both `{}` and `{tensor}` for {role}", earlier.info.name);
            return Err(ImportError::option("--map", found, "one tensor"));
        }
        let Some(info) = tensors.infos.iter().find(|info| info.name == *tensor) else {
            let found = format!("no tensor `{tensor}` for {role}");
            let expected = format!("one of {}", tensors.listing());
            return Err(tensors.refused(Place::Whole, found, expected));
        };
        let (role, chosen) = (role.clone(), Chosen::Mapped);
        used.push(Assigned { role, info, chosen });
    }
    Ok(used)
}

/// The phases as given, then others that have coefficients; all have some.
fn phases(
    tensors: &TensorFile<'_>,
    options: &ImportOptions,
    used: &[Assigned<'_>],
) -> Read<Vec<PhasePattern>> {
    let mut rules = options.phases.clone();
    // Sorted by name: `any` selects every pattern with a foot down, so the order of the two known phases does not
    // matter.
    for assigned in used {
        if let Role::Xi(name) = &assigned.role
            && options.given(name).is_none()
        {
            let found = format!("the coefficients {}", assigned.info.describe());
            let feet = options.feet_of(&tensors.file, name, &found)?;
            let name = name.clone();
            rules.push(PhasePattern { name, feet });
        }
    }
    let xi = |phase: &str| Role::Xi(phase.to_owned());
    if rules.is_empty() {
        return Err(tensors.missing(&xi("PHASE")));
    }
    let is_known = |phase: &str| rules.iter().any(|rule| rule.name == phase);
    let mut mapped = options.mapping.iter().map(|mapping| &mapping.role);
    if let Some(role) = mapped.find(|role| !role.phase().is_none_or(is_known)) {
        let names: Vec<&str> = rules.iter().map(|rule| rule.name.as_str()).collect();
        let found = format!("{role} for a phase that no --phase names");
        let expected = format!("one of the phases {}", names.join(", "));
        return Err(ImportError::option("--map", found, expected));
    }
    let mut roles = rules.iter().map(|rule| xi(&rule.name));
    match roles.find(|role| used.iter().all(|assigned| assigned.role != *role)) {
        None => Ok(rules),
        Some(role) => Err(tensors.missing(&role)),
    }
}
