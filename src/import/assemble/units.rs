//! Units and order of the robot's coordinates: scale factors, means that training took off, and the
//! order in which the file has them.

use nalgebra::{DMatrix, DVector};

use super::super::assign::Assigned;
use super::super::error::{ImportError, ImportFault};
use super::super::report::Note;
use super::super::role::Role;
use super::{Assembly, Parts};
use crate::model::{
    AffineMap, CoordinateOrder, InputStatistics, Layer, ScaleFactors, Scaling, StateMap,
};
use crate::robot::STATE_DIM;

impl<'a> Assembly<'a, '_> {
    /// Scale factors from tensors, or as given; in the file's order.
    pub(super) fn scaling(&mut self) -> Result<Option<Scaling>, ImportError> {
        let state = self.one_of(&Role::StateScaling, &Role::StateStd)?;
        let input = self.one_of(&Role::InputScaling, &Role::InputStd)?;
        let given = self.options.input_scaling.clone();
        let (state, input) = match (state, input, &self.options.scaling) {
            (None, None, scaling) => {
                if given.is_some() {
                    let found = "factors of the inputs alone";
                    let expected = "--scaling, or a tensor scaling.state or std.state";
                    return Err(ImportFault::option("--input-scaling", found, expected));
                }
                return Ok(scaling.clone());
            }
            (_, _, Some(_)) => {
                let found = "factors here and in tensors";
                return Err(ImportFault::option("--scaling", found, "one of the two"));
            }
            (None, Some(_), None) => return Err(self.tensors.missing(&Role::StateScaling)),
            (Some(state), input, None) => (state, input),
        };
        let input = match (input, given) {
            (Some(_), Some(_)) => {
                let found = "factors here and in a tensor";
                let expected = "one of the two";
                return Err(ImportFault::option("--input-scaling", found, expected));
            }
            (Some(input), None) => self.factors(input)?,
            (None, Some(given)) => given,
            (None, None) => {
                let found = format!("{} without factors of the inputs", state.info.describe());
                let expected = "a tensor scaling.input or std.input, or --input-scaling FACTOR";
                return Err(self.refused(state, found, expected));
            }
        };
        let state = self.factors(state)?;
        Ok(Some(Scaling { state, input }))
    }

    fn one_of(
        &self,
        factor: &Role,
        deviation: &Role,
    ) -> Result<Option<&'a Assigned<'a>>, ImportError> {
        match (self.find(factor), self.find(deviation)) {
            (Some(_), Some(other)) => {
                let found = format!("{deviation} beside {factor}");
                Err(self.refused(other, found, "one of the two"))
            }
            (one, None) | (None, one) => Ok(one),
        }
    }

    fn factors(&mut self, assigned: &Assigned<'_>) -> Result<ScaleFactors, ImportError> {
        let is_deviation = matches!(assigned.role, Role::StateStd | Role::InputStd);
        let count: usize = assigned.info.shape.iter().product();
        let dim = match count {
            1 => 1,
            _ => self.known.state.unwrap_or(count),
        };
        let mut values = self.list(assigned, dim)?;
        if is_deviation {
            if let Some(index) = values
                .iter()
                .position(|&v| !(v > 0.0 && (1.0 / v).is_finite()))
            {
                let found = values[index].to_string();
                let expected =
                    "a positive standard deviation (1 for a coordinate that never moved)";
                let place = assigned.place(&[index]);
                return Err(ImportFault::at(self.tensors.file(), place, found, expected));
            }
            values.apply(|value| *value = 1.0 / *value);
        }
        Ok(match dim {
            1 => ScaleFactors::Uniform(values[0]),
            _ => ScaleFactors::PerCoordinate(values),
        })
    }

    /// Takes the mean that the training subtracted into the biases: of `E(s (x - m))` and
    /// `D(z) / s + m` to `E'(s x)` and `D'(z) / s`.
    pub(super) fn fold_mean(&mut self, parts: &mut Parts) -> Result<(), ImportError> {
        let Some(assigned) = self.find(&Role::StateMean) else {
            return Ok(());
        };
        let (Some(encoder), Some(scaling)) = (&parts.encoder, &parts.scaling) else {
            let found = "a mean without encoder or scale factors";
            return Err(self.refused(assigned, found, "both"));
        };
        let dim = encoder.input_dim();
        let mean = self.list(assigned, dim)?;
        let offset = scaling.state.expand(dim).component_mul(&mean);
        let first = shifted(encoder, 0, |map| -(map.weights() * &offset));
        parts.encoder = Some(self.checked(first)?);
        if let Some(decoder) = &parts.decoder {
            let last = decoder.layers().len() - 1;
            let moved = shifted(decoder, last, |_| offset.clone());
            parts.decoder = Some(self.checked(moved)?);
        }
        self.notes.notes.push(Note::FoldedMean);
        Ok(())
    }

    fn checked(
        &self,
        map: Result<StateMap, crate::model::ModelError>,
    ) -> Result<StateMap, ImportError> {
        map.map_err(|source| ImportFault::model(self.tensors.file(), source))
    }

    /// Brings everything that is over the robot's coordinates into the robot's order.
    pub(super) fn sort(&mut self, parts: &mut Parts) -> Result<(), ImportError> {
        let Some(order) = &self.options.order else {
            return Ok(());
        };
        let maps = (parts.encoder.as_ref().map(StateMap::input_dim))
            .or(parts.decoder.as_ref().map(StateMap::output_dim));
        if maps != Some(STATE_DIM) {
            let found = match maps {
                None => "no encoder or decoder".to_owned(),
                Some(dim) => format!("an encoder or decoder of {dim} coordinates"),
            };
            return Err(ImportFault::option(
                "--order",
                found,
                "one of 18 coordinates",
            ));
        }
        if let Some(encoder) = &parts.encoder {
            parts.encoder = Some(self.checked(sorted(encoder, 0, |map| {
                let weights = order.sorted_rows(&map.weights().transpose()).transpose();
                (weights, map.bias().clone())
            }))?);
        }
        if let Some(decoder) = &parts.decoder {
            let last = decoder.layers().len() - 1;
            parts.decoder = Some(self.checked(sorted(decoder, last, |map| {
                (order.sorted_rows(map.weights()), order.sorted(map.bias()))
            }))?);
        }
        if let Some(scaling) = &mut parts.scaling {
            for factors in [&mut scaling.state, &mut scaling.input] {
                if let ScaleFactors::PerCoordinate(values) = factors
                    && values.len() == STATE_DIM
                {
                    *values = order.sorted(values);
                }
            }
        }
        for (_, statistics) in &mut parts.statistics {
            *statistics = sorted_statistics(statistics, order);
        }
        let order = order.to_string();
        self.notes.notes.push(Note::Sorted { order });
        Ok(())
    }
}

/// The map with something added to the bias of one layer.
fn shifted(
    map: &StateMap,
    layer: usize,
    addend: impl Fn(&AffineMap) -> DVector<f64>,
) -> Result<StateMap, crate::model::ModelError> {
    sorted(map, layer, |map| {
        (map.weights().clone(), map.bias() + addend(map))
    })
}

/// The map with other weights and bias in one layer.
fn sorted(
    map: &StateMap,
    layer: usize,
    change: impl Fn(&AffineMap) -> (DMatrix<f64>, DVector<f64>),
) -> Result<StateMap, crate::model::ModelError> {
    let mut layers: Vec<Layer> = map.layers().to_vec();
    let (weights, bias) = change(&layers[layer].map);
    layers[layer].map = AffineMap::new("layer", weights, bias)?;
    StateMap::new("map", layers)
}

fn sorted_statistics(statistics: &InputStatistics, order: &CoordinateOrder) -> InputStatistics {
    let rows = order.sorted_rows(&statistics.covariance);
    InputStatistics {
        mean: order.sorted(&statistics.mean),
        covariance: order.sorted_rows(&rows.transpose()).transpose(),
        given_state: statistics.given_state.clone(),
    }
}
