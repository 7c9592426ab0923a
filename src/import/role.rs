//! Parts of a model that a tensor can be.
#![allow(missing_docs, reason = "the names are self-explanatory")]

use super::*;

/// One of the two maps between robot and latent coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Part {
    Encoder,
    Decoder,
}

impl Part {
    pub(super) const ALL: [Self; 2] = [Part::Encoder, Part::Decoder];

    pub(super) fn holds(self, name: &str) -> bool {
        let mut modules = name.split(['.', '/']);
        modules.next_back();
        modules.any(|module| module.eq_ignore_ascii_case(self.name()))
    }

    pub(crate) fn name(self) -> &'static str {
        match self {
            Part::Encoder => "encoder",
            Part::Decoder => "decoder",
        }
    }
}

/// The use of a tensor; written `encoder.weight`, `xi.contact` and so on.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Role {
    /// `W_e` or `W_d`, or the weights of one of several layers by its number.
    Weights(Part, Option<usize>),
    /// `b_e` or `b_d`, or the bias of one of several layers.
    Bias(Part, Option<usize>),
    Xi(String),
    /// 0 for the coefficients of a phase that training switched off, 1 for the others.
    Mask(String),
    /// Mean of the training inputs of a phase, SI units.
    InputMean(String),
    /// Covariance of the training inputs of a phase, SI units.
    InputCovariance(String),
    /// `s_x`, one factor per robot coordinate.
    StateScaling,
    /// `s_u`, one factor per input coordinate.
    InputScaling,
    /// Mean of the training's states, SI units, subtracted before they were scaled.
    StateMean,
    /// Standard deviations by which the training divided states: `1 / s_x`.
    StateStd,
    /// Standard deviations by which the training divided inputs: `1 / s_u`.
    InputStd,
}

/// The phase of coefficients whose name has none.
pub(super) const ONLY_PHASE: &str = "always";

const EXPECTED: &str = "encoder.weight, encoder.bias, decoder.weight, decoder.bias (of a layer \
                        encoder.0.weight and so on), xi.PHASE, mask.PHASE, input_mean.PHASE, \
                        input_covariance.PHASE, scaling.state, scaling.input, mean.state, std.state \
                        or std.input";

/// First words of the parts of a phase; its name follows.
const OF_PHASES: [(&str, fn(String) -> Role); 5] = [
    ("xi", Role::Xi),
    ("sindy_coefficients", Role::Xi),
    ("mask", Role::Mask),
    ("input_mean", Role::InputMean),
    ("input_covariance", Role::InputCovariance),
];
const SINGLE: [(&str, Role); 5] = [
    ("scaling.state", Role::StateScaling),
    ("scaling.input", Role::InputScaling),
    ("mean.state", Role::StateMean),
    ("std.state", Role::StateStd),
    ("std.input", Role::InputStd),
];

impl fmt::Display for Role {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Role::Weights(part, layer) | Role::Bias(part, layer) = self {
            let layer = layer.map_or(String::new(), |layer| format!(".{layer}"));
            let is_bias = matches!(self, Role::Bias(..));
            let tensor = if is_bias { "bias" } else { "weight" };
            return write!(f, "{}{layer}.{tensor}", part.name());
        }
        if let Some(phase) = self.phase() {
            let is_own = |(_, role): &&(&str, fn(String) -> Role)| role(phase.to_owned()) == *self;
            let head = OF_PHASES.iter().find(is_own).map_or("", |(head, _)| head);
            return write!(f, "{head}.{phase}");
        }
        let single = SINGLE.iter().find(|(_, role)| role == self);
        f.write_str(single.map_or("", |(name, _)| name))
    }
}

impl FromStr for Role {
    type Err = ImportError;

    /// Reads the name of a part; underscores may stand for its dots.
    fn from_str(text: &str) -> Read<Self> {
        read_role(text)
            .ok_or_else(|| ImportError::option("--map", format!("the part {text:?}"), EXPECTED))
    }
}

const SEPARATORS: [char; 3] = ['.', '_', '/'];
/// Words in the names of tensors that an optimiser stores in addition to the parameters.
const OF_OPTIMISERS: &str = "adam optimizer momentum momentums rmsprop adagrad";

/// The rest of a name after its first word, in any case, and a separator.
fn after<'t>(head: &str, text: &'t str) -> Option<&'t str> {
    let (first, tail) = text.split_at_checked(head.len())?;
    let tail = tail.strip_prefix(SEPARATORS)?;
    (first.eq_ignore_ascii_case(head) && !tail.is_empty()).then_some(tail)
}

fn read_role(text: &str) -> Option<Role> {
    for (head, of_phase) in OF_PHASES {
        if let Some(phase) = after(head, text) {
            return Some(of_phase(phase.to_owned()));
        }
    }
    let mut without_phase = ["xi", "sindy_coefficients"].iter();
    if without_phase.any(|name| text.eq_ignore_ascii_case(name)) {
        return Some(Role::Xi(ONLY_PHASE.to_owned()));
    }
    let is_named = |(name, _): &(&str, Role)| text == *name || text == name.replace('.', "_");
    if let Some((_, single)) = SINGLE.into_iter().find(is_named) {
        return Some(single);
    }
    let mut parts = Part::ALL.into_iter();
    let (part, tail) = parts.find_map(|part| Some((part, after(part.name(), text)?)))?;
    let (module, tensor) = tail.rsplit_once(SEPARATORS).unwrap_or(("", tail));
    // A layer's number may end the name, as in `encoder_W0`.
    let stem = tensor.trim_end_matches(|c: char| c.is_ascii_digit());
    let module = if stem == tensor { module } else { tensor };
    match stem.to_lowercase().as_str() {
        "weight" | "weights" | "kernel" | "w" => Some(Role::Weights(part, layer(module)?)),
        "bias" | "biases" | "b" => Some(Role::Bias(part, layer(module)?)),
        _ => None,
    }
}

/// The last number in the names of modules: 2 of `net.2` and of `dense_2`; the first `dense` of Keras has none.
fn layer(modules: &str) -> Option<Option<usize>> {
    let numbers = modules.split(|c: char| !c.is_ascii_digit());
    match numbers.rev().find(|number| !number.is_empty()) {
        Some(number) => number.parse().ok().map(Some),
        None => Some((!modules.is_empty()).then_some(0)),
    }
}

impl Role {
    /// The part that a tensor is by its name, alone or behind names of modules (`autoencoder.encoder.0.weight`). A mask
    /// has the phase `always` where its phase is at most a word of its name.
    pub(crate) fn of_name(name: &str) -> Option<Self> {
        let name = without_tensorflow_end(name);
        if is_of_optimiser(name) {
            return None;
        }
        let ends = name.match_indices(['.', '/']);
        let ends = ends.map(|(dot, _)| &name[dot + 1..]);
        let role = std::iter::once(name).chain(ends).find_map(read_role);
        // An array named after the map alone is its weights.
        let last = name.rsplit(['.', '/']).next().unwrap_or(name);
        let mut parts = Part::ALL.into_iter();
        let map = parts.find(|part| last.eq_ignore_ascii_case(part.name()));
        let role = role.or(map.map(|part| Role::Weights(part, None)));
        let is_mask = words(name).any(|word| matches!(word.as_str(), "mask" | "masks"));
        match role {
            Some(Role::Mask(_)) => role,
            _ if is_mask => Some(Role::Mask(ONLY_PHASE.to_owned())),
            _ => role,
        }
    }

    pub(super) fn of_phase(mut self, phase: &str) -> Self {
        use Role::{InputCovariance, InputMean, Mask, Xi};
        if let Xi(own) | Mask(own) | InputMean(own) | InputCovariance(own) = &mut self {
            phase.clone_into(own);
        }
        self
    }

    pub(crate) fn phase(&self) -> Option<&str> {
        use Role::{InputCovariance, InputMean, Mask, Xi};
        match self {
            Xi(phase) | Mask(phase) | InputMean(phase) | InputCovariance(phase) => Some(phase),
            _ => None,
        }
    }
}

pub(super) fn without_tensorflow_end(name: &str) -> &str {
    let name = name.trim_end_matches("/.ATTRIBUTES/VARIABLE_VALUE");
    name.trim_end_matches(":0")
}

fn words(name: &str) -> impl Iterator<Item = String> {
    let words = name.split(|c: char| !c.is_ascii_alphanumeric());
    words.map(str::to_lowercase)
}

/// Whether the words of a name contain those of another, next to each other.
pub(super) fn mentions(name: &str, other: &str) -> bool {
    let joined = |text: &str| format!("_{}_", words(text).collect::<Vec<_>>().join("_"));
    joined(name).contains(&joined(other))
}

pub(super) fn is_of_optimiser(name: &str) -> bool {
    words(name).any(|word| OF_OPTIMISERS.split(' ').any(|known| known == word))
}

/// `--map ROLE=TENSOR`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mapping {
    pub(crate) role: Role,
    pub tensor: String,
}

impl FromStr for Mapping {
    type Err = ImportError;

    fn from_str(text: &str) -> Read<Self> {
        match text.split_once('=') {
            Some((role, tensor)) if !tensor.is_empty() => Ok(Mapping {
                role: role.trim().parse()?,
                tensor: tensor.to_owned(),
            }),
            _ => {
                let expected = "PART=TENSOR, such as encoder.weight=net.enc.0.weight";
                Err(ImportError::option("--map", format!("{text:?}"), expected))
            }
        }
    }
}
