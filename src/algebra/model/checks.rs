//! Checks of single parts of a model: names, shapes, widths of layers.

use super::coordinate_names::CoordinateNames;
use super::error::{ModelError, check_shape};
use super::identifier::Identifier;
use super::state_map::StateMap;
use crate::robot::Robot;

/// Refuses a name that a model cannot have, before one is made.
///
/// # Errors
/// [`ModelError::Name`].
pub fn check_name(name: &str) -> Result<(), ModelError> {
    identifier_of("model name", name).map(|_| ())
}

pub(super) fn identifier_of(what: &str, name: &str) -> Result<Identifier, ModelError> {
    Identifier::from_name(name).map_err(|source| ModelError::Name {
        what: what.to_owned(),
        name: name.chars().take(80).collect(),
        source,
    })
}

pub(super) fn check_robot_names(
    signals: &'static str,
    given: &Option<CoordinateNames>,
    expected: &[String],
    robot: &Robot,
) -> Result<(), ModelError> {
    let Some(given) = given else {
        return Ok(());
    };
    for (index, (found, expected)) in given.names.iter().zip(expected).enumerate() {
        if found != expected {
            let place = format!("`{signals}.names`[{index}]");
            let expected = format!("{expected:?} as on robot {}", robot.name());
            return Err(ModelError::invalid(place, format!("{found:?}"), expected));
        }
    }
    Ok(())
}

/// Checks what enters the first layer and what leaves the last; `expected` is the Jacobian's shape.
pub(super) fn check_map(
    name: &str,
    map: &StateMap,
    expected: (usize, usize),
) -> Result<(), ModelError> {
    if let Some(affine) = map.as_affine() {
        let (tensor, found) = (format!("{name}.weights"), affine.weights().shape());
        return check_shape(&tensor, found, expected);
    }
    let last = map.layers().len() - 1;
    let ends = [(0, None, Some(expected.1)), (last, Some(expected.0), None)];
    for (layer, rows, columns) in ends {
        let found = map.layers()[layer].map.weights().shape();
        let expected = (rows.unwrap_or(found.0), columns.unwrap_or(found.1));
        check_shape(&format!("{name}.layers[{layer}].weights"), found, expected)?;
    }
    Ok(())
}

/// No layer of an encoder may be narrower than the latent space, or its Jacobian never has full
/// rank.
pub(super) fn check_widths(encoder: &StateMap, latent_dim: usize) -> Result<(), ModelError> {
    let widths = encoder.layers().iter().map(|layer| layer.map.output_dim());
    match widths.enumerate().find(|&(_, width)| width < latent_dim) {
        None => Ok(()),
        Some((layer, found)) => {
            let expected = format!("at least {latent_dim}, one per latent coordinate");
            let place = format!("`encoder.layers[{layer}]`");
            let found = format!("{found} units");
            Err(ModelError::invalid(place, found, expected))
        }
    }
}
