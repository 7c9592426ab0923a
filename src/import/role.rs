//! Parts of a model that a tensor can be.

use std::fmt;
use std::str::FromStr;

use super::error::ImportError;

/// One of the two maps between robot and latent coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Part {
    /// Robot to latent coordinates.
    Encoder,
    /// Latent to robot coordinates.
    Decoder,
}

impl Part {
    /// The key of the model file.
    pub fn name(self) -> &'static str {
        match self {
            Part::Encoder => "encoder",
            Part::Decoder => "decoder",
        }
    }
}

/// What a tensor is used as; written `encoder.weight`, `xi.contact` and so on.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Role {
    /// `W_e` or `W_d`.
    Weights(Part),
    /// `b_e` or `b_d`.
    Bias(Part),
    /// Weights of one of several layers, in the order of their numbers.
    LayerWeights(Part, usize),
    /// Bias of one of several layers.
    LayerBias(Part, usize),
    /// Coefficients of a phase.
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
}

const EXPECTED: &str = "encoder.weight, encoder.bias, decoder.weight, decoder.bias (of a layer \
                        encoder.0.weight and so on), xi.PHASE, mask.PHASE, input_mean.PHASE, \
                        input_covariance.PHASE, scaling.state or scaling.input";

impl fmt::Display for Role {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Role::Weights(part) => write!(f, "{}.weight", part.name()),
            Role::Bias(part) => write!(f, "{}.bias", part.name()),
            Role::LayerWeights(part, layer) => write!(f, "{}.{layer}.weight", part.name()),
            Role::LayerBias(part, layer) => write!(f, "{}.{layer}.bias", part.name()),
            Role::Xi(phase) => write!(f, "xi.{phase}"),
            Role::Mask(phase) => write!(f, "mask.{phase}"),
            Role::InputMean(phase) => write!(f, "input_mean.{phase}"),
            Role::InputCovariance(phase) => write!(f, "input_covariance.{phase}"),
            Role::StateScaling => f.write_str("scaling.state"),
            Role::InputScaling => f.write_str("scaling.input"),
        }
    }
}

impl FromStr for Role {
    type Err = ImportError;

    fn from_str(text: &str) -> Result<Self, ImportError> {
        read_role(text)
            .ok_or_else(|| ImportError::option("--map", format!("the part {text:?}"), EXPECTED))
    }
}

fn read_role(text: &str) -> Option<Role> {
    let (head, tail) = text.split_once('.').filter(|(_, tail)| !tail.is_empty())?;
    let part = match head {
        "encoder" => Part::Encoder,
        "decoder" => Part::Decoder,
        "scaling" if tail == "state" => return Some(Role::StateScaling),
        "scaling" if tail == "input" => return Some(Role::InputScaling),
        "xi" => return Some(Role::Xi(tail.to_owned())),
        "mask" => return Some(Role::Mask(tail.to_owned())),
        "input_mean" => return Some(Role::InputMean(tail.to_owned())),
        "input_covariance" => return Some(Role::InputCovariance(tail.to_owned())),
        _ => return None,
    };
    match tail.split_once('.') {
        None => match tail {
            "weight" | "weights" => Some(Role::Weights(part)),
            "bias" => Some(Role::Bias(part)),
            _ => None,
        },
        Some((layer, tensor)) => match tensor {
            "weight" | "weights" => Some(Role::LayerWeights(part, layer.parse().ok()?)),
            "bias" => Some(Role::LayerBias(part, layer.parse().ok()?)),
            _ => None,
        },
    }
}

impl Role {
    /// The phase that the tensor belongs to, if it belongs to one.
    pub fn phase(&self) -> Option<&str> {
        match self {
            Role::Xi(phase)
            | Role::Mask(phase)
            | Role::InputMean(phase)
            | Role::InputCovariance(phase) => Some(phase),
            Role::Weights(_)
            | Role::Bias(_)
            | Role::LayerWeights(..)
            | Role::LayerBias(..)
            | Role::StateScaling
            | Role::InputScaling => None,
        }
    }

    /// The layer's number and the map that it belongs to, of weights of one of several layers.
    pub(super) fn layer(&self) -> Option<(Part, usize)> {
        match self {
            Role::LayerWeights(part, number) => Some((*part, *number)),
            _ => None,
        }
    }
}

/// `--map ROLE=TENSOR`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mapping {
    /// What the tensor is used as.
    pub role: Role,
    /// Its name in the file.
    pub tensor: String,
}

impl FromStr for Mapping {
    type Err = ImportError;

    fn from_str(text: &str) -> Result<Self, ImportError> {
        match text.split_once('=') {
            Some((role, tensor)) if !tensor.is_empty() => Ok(Mapping {
                role: role.trim().parse()?,
                tensor: tensor.to_owned(),
            }),
            _ => Err(ImportError::option(
                "--map",
                format!("{text:?}"),
                "PART=TENSOR, such as encoder.weight=net.enc.0.weight",
            )),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn role_text_reads_back() {
        let contact = || "contact".to_owned();
        for role in [
            Role::Weights(Part::Encoder),
            Role::Weights(Part::Decoder),
            Role::Bias(Part::Encoder),
            Role::Bias(Part::Decoder),
            Role::LayerWeights(Part::Encoder, 0),
            Role::LayerBias(Part::Decoder, 12),
            Role::Xi(contact()),
            Role::Mask(contact()),
            Role::InputMean(contact()),
            Role::InputCovariance(contact()),
            Role::StateScaling,
            Role::InputScaling,
        ] {
            assert_eq!(role.to_string().parse::<Role>().expect("own text"), role);
        }
    }

    #[test]
    fn mapping_without_part_or_tensor_is_refused() {
        for text in [
            "",
            "encoder.weight",
            "encoder.weight=",
            "=W",
            "encoder=W",
            "xi.=W",
        ] {
            let error = text.parse::<Mapping>().expect_err(text);
            assert!(error.to_string().starts_with("--map: found "), "{error}");
        }
    }

    #[test]
    fn mapping_splits_at_the_first_equals_sign() {
        let mapping: Mapping = "xi.contact=a=b/c:0".parse().expect("a part and a tensor");
        assert_eq!(mapping.role, Role::Xi("contact".to_owned()));
        assert_eq!(mapping.tensor, "a=b/c:0");
    }
}
