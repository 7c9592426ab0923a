//! What the recordings of `romc import --inputs-from` say of the imported model.

use std::fmt::Write as _;

use serde_json::{Value, json};

use crate::evaluate::{AccelerationSlip, RoundTrip, Slip};

/// Whether the model is not to be taken: its maps miss the recordings, or a slip explains why its
/// equations do. Equations that miss them for no known reason may be right for other motions.
pub fn is_refused(check: &RoundTrip) -> bool {
    !check.maps_fit() || (!check.equations_fit() && check.acceleration_slip.is_some())
}

/// What is wrong with the model along the recordings, if anything is.
pub fn fault(check: &RoundTrip) -> Option<String> {
    if !check.maps_fit() {
        let found = format!(
            "decode(encode(x)) misses the recordings by {:.3} times their variance",
            check.error
        );
        return Some(match &check.slip {
            Some((slip, error)) => format!("{found}, by {error:.3} times {}", advice(slip)),
            None => format!(
                "{found}, whatever the usual factors, means and orders: is it this robot, and are \
                 these its maps?"
            ),
        });
    }
    if check.equations_fit() {
        return None;
    }
    let r2 = check.all_acceleration_r2.unwrap_or(f64::NAN);
    let found = format!("R^2 of the latent accelerations is {r2:.3}");
    Some(match check.acceleration_slip {
        Some((AccelerationSlip::Centred, better)) => {
            format!("{found}, {better:.3} {}", advice(&Slip::Centred))
        }
        Some((AccelerationSlip::InputFactor(factor), better)) => format!(
            "{found}, {better:.3} with the inputs times {factor}: expected other factors of the \
             inputs (--input-scaling, or a tensor scaling.input or std.input)"
        ),
        None => format!(
            "{found}, below that of a constant: are these motions unlike the training's, or the \
             coefficients in another order than the candidate terms?"
        ),
    })
}

/// What to pass where a slip explains the error.
fn advice(slip: &Slip) -> String {
    match slip {
        Slip::Order(order) => format!(
            "in another order: expected --order {order}, or another that swaps left and right"
        ),
        Slip::Factor(factor) => format!("with factor {factor}: expected --scaling {factor}"),
        Slip::Centred => {
            "with their mean taken off: expected a tensor mean.state (SI units)".to_owned()
        }
        Slip::Standardised => {
            "as (x - mean) / standard deviation: expected tensors mean.state and \
                               std.state (SI units)"
                .to_owned()
        }
        Slip::Both(order, slip) => {
            format!("in another order, {}, and --order {order}", advice(slip))
        }
    }
}

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
    if let Some(fault) = fault(check) {
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
        "fault": fault(check),
    })
}
