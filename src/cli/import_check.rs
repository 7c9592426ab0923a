//! What the recordings of `romc import --inputs-from` say of the imported model.

use std::fmt::Write as _;

use serde_json::{Value, json};

use crate::evaluate::RoundTrip;

/// The check as text.
pub fn describe(check: &RoundTrip) -> String {
    let mut text = format!(
        "\nOn the recordings: decode(encode(x)) misses {:.3} of the variance",
        check.error
    );
    for (phase, r2) in &check.acceleration_r2 {
        if let Some(r2) = r2 {
            let _ = write!(text, "; R^2 of ddz in {phase} {r2:.3}");
        }
    }
    text.push('\n');
    if let Some(fault) = check.fault() {
        let _ = writeln!(text, "warning: {fault}");
    }
    text.push('\n');
    text
}

/// The check as JSON.
pub fn json(check: &RoundTrip) -> Value {
    let phases = check.acceleration_r2.iter();
    let phases = phases
        .map(|(phase, r2)| (phase.clone(), json!(r2)))
        .collect();
    json!({
        "reconstruction_error": check.error,
        "acceleration_r2": Value::Object(phases),
        "fault": check.fault(),
    })
}
