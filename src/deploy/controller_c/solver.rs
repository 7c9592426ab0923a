//! The structured solver in C: the text that is made from its Rust, under the names and sizes of an instance.

/// A stage of the solver, and all else.
const STAGE: &str = include_str!("../../../templates/controller_c/solver_stage.h");
const FUNCTIONS: &str = include_str!("../../../templates/controller_c/solver.c");
const STATE: &str = include_str!("../../../templates/controller_c/online_state.h");
const ONLINE: &str = include_str!("../../../templates/controller_c/online.c");

/// The controller's own steps.
pub(super) fn online(name: &str) -> String {
    renamed(ONLINE, |word| {
        (word == "online_share").then(|| format!("{name}_{word}"))
    })
}

/// A stage of the horizon's solver and the controller's own state, for the header of a controller.
pub(super) fn stage(name: &str, upper: &str, real: &str) -> String {
    renamed(
        &format!(
            "{STAGE}{}",
            STATE.split_once("\n\n").map_or("", |(_, rest)| rest)
        ),
        |word| match word {
            "real" => Some(real.to_owned()),
            "NX" => Some(format!("2 * {upper}_LATENT_DIM")),
            "NU" => Some(format!("{upper}_LATENT_DIM")),
            "online_share" => Some(format!("{name}_{word}")),
            _ => word
                .starts_with("solver_")
                .then(|| format!("{name}_{word}")),
        },
    )
}

/// The solver of the horizon.
pub(super) fn of_horizon(name: &str) -> String {
    renamed(FUNCTIONS, |word| {
        (word == "solver_stage").then(|| format!("{name}_{word}"))
    })
}

/// The solver of a lift: one stage of twelve inputs, without states that matter.
pub(super) fn of_lift() -> String {
    let lift = |word: &str| {
        Some(match word {
            "NX" => "1".to_owned(),
            "NU" => "12".to_owned(),
            "LINKED" => "0".to_owned(),
            _ if word.starts_with("solver_") => format!("lift_{word}"),
            _ if word.starts_with("SOLVER_") => format!("LIFT_{word}"),
            _ => return None,
        })
    };
    renamed(STAGE, lift) + &renamed(FUNCTIONS, lift)
}

/// A text of C behind its first comment, with other names.
fn renamed(text: &str, rename: impl Fn(&str) -> Option<String>) -> String {
    let text = text.split_once("\n\n").map_or(text, |(_, rest)| rest);
    let mut out = String::with_capacity(2 * text.len());
    let mut rest = text;
    while let Some(first) = rest.find(|letter: char| letter.is_ascii_alphabetic()) {
        let after = &rest[first..];
        let is_part = |letter: char| letter.is_ascii_alphanumeric() || letter == '_';
        let end = after.find(|letter| !is_part(letter)).unwrap_or(after.len());
        out += &rest[..first];
        out += &rename(&after[..end]).unwrap_or_else(|| after[..end].to_owned());
        rest = &after[end..];
    }
    out + rest
}
