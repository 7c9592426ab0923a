//! Parts of a model by the names of their tensors.
//!
//! A name is cut into words at punctuation, at capital letters and around numbers: `net.enc.0.weight`
//! is `net enc 0 weight`, `W_e` is `w e`, `xiContact` is `xi contact`.

use super::role::{Part, Role};

/// The words of the documented names, each with its usual spellings; then the words of an
/// optimiser's state, and those that say nothing about a phase.
const SPELLINGS: [(&str, &str); 9] = [
    ("encoder", "encoder enc encode"),
    ("decoder", "decoder dec decode"),
    ("weight", "weight weights kernel w"),
    ("bias", "bias biases b"),
    (
        "xi",
        "xi sindy coefficient coefficients coef coefs coeff coeffs",
    ),
    ("mask", "mask masks"),
    ("covariance", "covariance cov"),
    (
        "optimiser",
        "adam optimizer optimiser momentum grad exp avg",
    ),
    (
        "",
        "model module net network layer param params parameter parameters learned values",
    ),
];

/// The part that a name stands for; the phase is empty if the name has none.
pub(super) fn role_of(name: &str) -> Option<Role> {
    let words = words(name);
    let known = |word: &str| {
        SPELLINGS
            .iter()
            .find(|(_, list)| list.split(' ').any(|w| w == word))
    };
    let texts = words.iter().map(String::as_str);
    let texts: Vec<&str> = texts
        .map(|word| known(word).map_or(word, |(word, _)| word))
        .collect();
    let phase = |rest: &[&str]| {
        let kept = rest
            .iter()
            .filter(|word| !["", "weight", "xi", "mask"].contains(word));
        kept.copied().collect::<Vec<_>>().join("_")
    };
    match texts[..] {
        ["weight", "e"] | ["we"] => return Some(Role::Weights(Part::Encoder)),
        ["weight", "d"] | ["wd"] => return Some(Role::Weights(Part::Decoder)),
        ["bias", "e"] | ["be"] => return Some(Role::Bias(Part::Encoder)),
        ["bias", "d"] | ["bd"] => return Some(Role::Bias(Part::Decoder)),
        ["scaling", "state"] => return Some(Role::StateScaling),
        ["scaling", "input"] => return Some(Role::InputScaling),
        ["input", "mean", ref rest @ ..] => return Some(Role::InputMean(phase(rest))),
        ["input", "covariance", ref rest @ ..] => return Some(Role::InputCovariance(phase(rest))),
        _ => {}
    }
    let has = |word| texts.contains(&word);
    let part = match (has("encoder"), has("decoder")) {
        _ if has("optimiser") => return None,
        // `autoencoder.decoder.weight` has one of them; a name with both says nothing.
        (true, true) => return None,
        (true, false) => Some(Part::Encoder),
        (false, true) => Some(Part::Decoder),
        (false, false) => None,
    };
    match (part, has("weight"), has("bias"), has("mask")) {
        (Some(part), true, false, false) => Some(Role::Weights(part)),
        (Some(part), false, true, false) => Some(Role::Bias(part)),
        (Some(_), ..) => None,
        (None, _, _, true) => Some(Role::Mask(phase(&texts))),
        (None, _, false, false) if has("xi") => Some(Role::Xi(phase(&texts))),
        (None, ..) => None,
    }
}

/// The layer that a name stands for: its words without numbers, and the numbers.
pub(super) fn layer_of(name: &str) -> (Vec<String>, Vec<u64>) {
    let (numbers, rest): (Vec<String>, Vec<String>) =
        (words(name).into_iter()).partition(|word| word.starts_with(|c: char| c.is_ascii_digit()));
    (
        rest,
        numbers.iter().filter_map(|n| n.parse().ok()).collect(),
    )
}

/// Whether two texts name one phase: `rear stance`, `rear_stance` and `RearStance` do.
pub(super) fn is_same_phase(a: &str, b: &str) -> bool {
    words(a).concat() == words(b).concat()
}

/// The lower-case words of a name, numbers apart, without TensorFlow's `:0`.
fn words(name: &str) -> Vec<String> {
    let mut words: Vec<String> = Vec::new();
    let mut last = ' ';
    let name = name.strip_suffix(":0").unwrap_or(name);
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

    #[test]
    fn names_of_the_help_text_and_their_usual_spellings_are_known() {
        let phase = |text: &str| text.to_owned();
        for (role, names) in [
            (
                Role::Weights(Part::Encoder),
                "encoder.weight encoder.0.weight module.encoder.linear.weight net.enc.0.weight \
                 encoder/kernel:0 encoder_weights W_e We W_enc autoencoder.encoder.weight",
            ),
            (
                Role::Bias(Part::Decoder),
                "decoder.bias decoder.0.bias b_d dec/bias:0 b_dec",
            ),
            (Role::StateScaling, "scaling.state scaling_state"),
            (Role::InputScaling, "scaling.input"),
            (
                Role::Xi(phase("contact")),
                "xi.contact xi_contact xiContact xi.contact.weight coefs_contact",
            ),
            (Role::Xi(phase("")), "Xi model.sindy_coefficients"),
            (Role::Xi(phase("rear_stance")), "coefs_rear_stance"),
            (
                Role::Mask(phase("contact")),
                "mask.contact coefficient_mask_contact",
            ),
            (Role::InputMean(phase("flight")), "input_mean.flight"),
            (
                Role::InputCovariance(phase("flight")),
                "input_covariance.flight input_cov_flight",
            ),
        ] {
            for name in names.split(' ') {
                assert_eq!(role_of(name).as_ref(), Some(&role), "{name}");
            }
        }
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
            assert_eq!(role_of(name), None, "{name}");
        }
    }

    #[test]
    fn layers_differ_in_numbers_only() {
        assert_eq!(
            layer_of("encoder.0.weight").0,
            layer_of("encoder.2.weight").0
        );
        assert_eq!(layer_of("enc.fc1.weight").0, layer_of("enc.fc12.weight").0);
        assert_eq!(layer_of("enc.fc12.weight").1, [12]);
        assert_ne!(
            layer_of("encoder.weight").0,
            layer_of("model.encoder.weight").0
        );
    }

    #[test]
    fn phases_are_recognised_in_any_spelling() {
        assert!(is_same_phase("rear_stance", "RearStance"));
        assert!(!is_same_phase("rear", "rear_stance"));
    }
}
