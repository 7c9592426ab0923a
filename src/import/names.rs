//! Guesses what a tensor is from its name.
//!
//! A name is cut into words at punctuation, at capital letters and around numbers:
//! `net.enc.0.weight` is `net enc 0 weight`, `W_e` is `w e`, `xiContact` is `xi contact`.

use super::role::Part;

const ENCODER: [&str; 3] = ["encoder", "enc", "encode"];
const DECODER: [&str; 3] = ["decoder", "dec", "decode"];
const WEIGHTS: [&str; 4] = ["weight", "weights", "kernel", "w"];
const BIAS: [&str; 3] = ["bias", "biases", "b"];
const XI: [&str; 8] = [
    "xi",
    "sindy",
    "coefficient",
    "coefficients",
    "coef",
    "coefs",
    "coeff",
    "coeffs",
];
const MASK: [&str; 2] = ["mask", "masks"];
/// Words of an optimiser's state: such a tensor is no weight.
const OTHER: [&str; 7] = [
    "adam",
    "optimizer",
    "optimiser",
    "momentum",
    "grad",
    "exp",
    "avg",
];
/// Words that say nothing about a phase.
const GENERIC: [&str; 14] = [
    "model",
    "module",
    "net",
    "network",
    "layer",
    "weight",
    "weights",
    "kernel",
    "param",
    "params",
    "parameter",
    "parameters",
    "learned",
    "values",
];

/// What a name suggests.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Guess {
    Weights(Part),
    Bias(Part),
    /// Coefficients; the words that name the phase, possibly none.
    Xi(Vec<String>),
    Mask(Vec<String>),
    InputMean(Vec<String>),
    InputCovariance(Vec<String>),
}

/// What the name of a tensor suggests, if anything.
pub(super) fn guess(name: &str) -> Option<Guess> {
    let words = words(name.strip_suffix(":0").unwrap_or(name));
    let has = |list: &[&str]| words.iter().any(|word| list.contains(&word.as_str()));
    let texts: Vec<&str> = words.iter().map(String::as_str).collect();
    match texts.as_slice() {
        ["w", "e"] | ["we"] => return Some(Guess::Weights(Part::Encoder)),
        ["w", "d"] | ["wd"] => return Some(Guess::Weights(Part::Decoder)),
        ["b", "e"] | ["be"] => return Some(Guess::Bias(Part::Encoder)),
        ["b", "d"] | ["bd"] => return Some(Guess::Bias(Part::Decoder)),
        ["input", "mean", phase @ ..] => return Some(Guess::InputMean(phase_words(phase))),
        ["input", "covariance" | "cov", phase @ ..] => {
            return Some(Guess::InputCovariance(phase_words(phase)));
        }
        _ => {}
    }
    if has(&OTHER) {
        return None;
    }
    let part = match (has(&ENCODER), has(&DECODER)) {
        (true, false) => Some(Part::Encoder),
        (false, true) => Some(Part::Decoder),
        // `autoencoder.decoder.weight` has one of them; a name with both says nothing.
        (true, true) => return None,
        (false, false) => None,
    };
    if let Some(part) = part {
        return match (has(&WEIGHTS), has(&BIAS), has(&MASK)) {
            (true, false, false) => Some(Guess::Weights(part)),
            (false, true, false) => Some(Guess::Bias(part)),
            _ => None,
        };
    }
    let rest: Vec<&str> = (texts.iter().copied())
        .filter(|word| !XI.contains(word) && !MASK.contains(word))
        .collect();
    match (has(&XI), has(&MASK)) {
        (_, true) => Some(Guess::Mask(phase_words(&rest))),
        (true, false) if !has(&BIAS) => Some(Guess::Xi(phase_words(&rest))),
        _ => None,
    }
}

/// Whether two names differ in their numbers at most: layers of one network.
pub(super) fn are_layers(first: &str, second: &str) -> bool {
    let without_numbers = |name: &str| -> Vec<String> {
        let mut words = words(name);
        words.retain(|word| !word.starts_with(|c: char| c.is_ascii_digit()));
        words
    };
    without_numbers(first) == without_numbers(second)
}

/// The numbers in a name, which tell the layer: `encoder.2.weight` has `[2]`.
pub(super) fn numbers(name: &str) -> Vec<u64> {
    let words = words(name.strip_suffix(":0").unwrap_or(name));
    words.iter().filter_map(|word| word.parse().ok()).collect()
}

/// Whether these words name this phase: `rear stance` names `rear_stance` and `RearStance`.
pub(super) fn name_phase(found: &[String], phase: &str) -> bool {
    found.concat() == words(phase).concat()
}

fn phase_words(found: &[&str]) -> Vec<String> {
    let kept = found.iter().filter(|word| !GENERIC.contains(word));
    kept.map(|&word| word.to_owned()).collect()
}

/// The lower-case words of a name, numbers apart.
fn words(name: &str) -> Vec<String> {
    let mut words: Vec<String> = Vec::new();
    let mut last = ' ';
    for c in name.chars().filter(|c| !c.is_control()) {
        if c.is_alphanumeric() {
            let starts = !last.is_alphanumeric()
                || (c.is_uppercase() && last.is_lowercase())
                || c.is_ascii_digit() != last.is_ascii_digit();
            if starts {
                words.push(String::new());
            }
            let word = words.last_mut().expect("the first letter starts a word");
            word.extend(c.to_lowercase());
        }
        last = c;
    }
    words
}

#[cfg(test)]
mod tests {
    use super::*;

    fn phase(words: &[&str]) -> Vec<String> {
        words.iter().map(|&word| word.to_owned()).collect()
    }

    #[test]
    fn usual_names_of_weights_and_biases_are_known() {
        let encoder = Some(Guess::Weights(Part::Encoder));
        for name in [
            "encoder.weight",
            "encoder.0.weight",
            "module.encoder.linear.weight",
            "net.enc.0.weight",
            "encoder/kernel:0",
            "encoder_weights",
            "W_e",
            "We",
            "W_enc",
            "autoencoder.encoder.weight",
        ] {
            assert_eq!(guess(name), encoder, "{name}");
        }
        let decoder = Some(Guess::Bias(Part::Decoder));
        for name in [
            "decoder.bias",
            "decoder.0.bias",
            "b_d",
            "dec/bias:0",
            "b_dec",
        ] {
            assert_eq!(guess(name), decoder, "{name}");
        }
    }

    #[test]
    fn usual_names_of_coefficients_tell_their_phase() {
        for (name, expected) in [
            ("xi_contact", phase(&["contact"])),
            ("Xi", phase(&[])),
            ("model.sindy_coefficients.flight", phase(&["flight"])),
            ("coefs_rear_stance", phase(&["rear", "stance"])),
            ("xi.contact.weight", phase(&["contact"])),
        ] {
            assert_eq!(guess(name), Some(Guess::Xi(expected)), "{name}");
        }
        assert_eq!(
            guess("coefficient_mask_contact"),
            Some(Guess::Mask(phase(&["contact"])))
        );
        assert_eq!(
            guess("input_covariance.flight"),
            Some(Guess::InputCovariance(phase(&["flight"])))
        );
    }

    #[test]
    fn names_of_other_things_are_left_alone() {
        for name in [
            "",
            "time",
            "encoder.running_mean",
            "adam/encoder/kernel",
            "encoder.decoder.weight",
            "sindy.bias",
            "linear.weight",
        ] {
            assert_eq!(guess(name), None, "{name}");
        }
    }

    #[test]
    fn layers_differ_in_numbers_only() {
        assert!(are_layers("encoder.0.weight", "encoder.2.weight"));
        assert!(are_layers("enc.fc1.weight", "enc.fc12.weight"));
        assert!(!are_layers("encoder.weight", "model.encoder.weight"));
    }

    #[test]
    fn phases_are_recognised_in_any_spelling() {
        assert!(name_phase(&phase(&["rear", "stance"]), "rear_stance"));
        assert!(name_phase(&phase(&["rear", "stance"]), "RearStance"));
        assert!(!name_phase(&phase(&["rear"]), "rear_stance"));
    }
}
