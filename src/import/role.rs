//! What a tensor is used as.

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
    /// Weights of one of several layers; the number tells their order.
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
    /// `s_x`, one factor a robot coordinate.
    StateScaling,
    /// `s_u`, one factor an input coordinate.
    InputScaling,
}

const EXPECTED: &str = "encoder.weight, encoder.bias, decoder.weight, decoder.bias (of a layer \
                        encoder.0.weight and so on), xi.PHASE, mask.PHASE, input_mean.PHASE, input_covariance.PHASE, scaling.state or \
                        scaling.input";

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
        let unknown = || ImportError::Option {
            option: "--map",
            found: format!("the part {text:?}"),
            expected: EXPECTED.to_owned(),
        };
        let (head, tail) = text.split_once('.').ok_or_else(unknown)?;
        let phase = tail.to_owned();
        match (head, tail) {
            (_, "") => Err(unknown()),
            ("encoder", "weight" | "weights") => Ok(Role::Weights(Part::Encoder)),
            ("encoder", "bias") => Ok(Role::Bias(Part::Encoder)),
            ("decoder", "weight" | "weights") => Ok(Role::Weights(Part::Decoder)),
            ("decoder", "bias") => Ok(Role::Bias(Part::Decoder)),
            ("encoder" | "decoder", _) => layer_role(head, tail).ok_or_else(unknown),
            ("scaling", "state") => Ok(Role::StateScaling),
            ("scaling", "input") => Ok(Role::InputScaling),
            ("xi", _) => Ok(Role::Xi(phase)),
            ("mask", _) => Ok(Role::Mask(phase)),
            ("input_mean", _) => Ok(Role::InputMean(phase)),
            ("input_covariance", _) => Ok(Role::InputCovariance(phase)),
            _ => Err(unknown()),
        }
    }
}

/// `0.weight` of an encoder or decoder.
fn layer_role(head: &str, tail: &str) -> Option<Role> {
    let part = match head {
        "encoder" => Part::Encoder,
        _ => Part::Decoder,
    };
    let (number, tensor) = tail.split_once('.')?;
    let number = number.parse().ok()?;
    match tensor {
        "weight" | "weights" => Some(Role::LayerWeights(part, number)),
        "bias" => Some(Role::LayerBias(part, number)),
        _ => None,
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
            _ => Err(ImportError::Option {
                option: "--map",
                found: format!("{text:?}"),
                expected: "PART=TENSOR, such as encoder.weight=net.enc.0.weight".to_owned(),
            }),
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
            assert!(
                matches!(
                    text.parse::<Mapping>(),
                    Err(ImportError::Option {
                        option: "--map",
                        ..
                    })
                ),
                "{text}"
            );
        }
    }

    #[test]
    fn mapping_splits_at_the_first_equals_sign() {
        let mapping: Mapping = "xi.contact=a=b/c:0".parse().expect("a part and a tensor");
        assert_eq!(mapping.role, Role::Xi("contact".to_owned()));
        assert_eq!(mapping.tensor, "a=b/c:0");
    }
}
