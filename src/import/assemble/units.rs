//! Units and order of the robot's coordinates: scale factors, means that training took off, and the order in which the
//! file has them.

use nalgebra::{DMatrix, DVector};

use super::super::ImportError;
use super::super::assign::Assigned;
use super::super::role::Role;
use super::{Assembly, Parts};
use crate::model::{AffineMap, ScaleFactors, Scaling, StateMap};
use crate::robot::STATE_DIM;

impl<'a> Assembly<'a, '_> {
    /// Scale factors from tensors, or as given; in the file's order.
    pub(super) fn scaling(&mut self) -> Result<Option<Scaling>, ImportError> {
        let state = self.one_of(&Role::StateScaling, &Role::StateStd)?;
        let input = self.one_of(&Role::InputScaling, &Role::InputStd)?;
        let given = self.options.input_scaling.clone();
        let refused =
            |option, found: &str, expected: &str| Err(ImportError::option(option, found, expected));
        if self.options.scaling.is_some() && (state.is_some() || input.is_some()) {
            return refused("--scaling", "factors here and in tensors", "one of the two");
        }
        let (state, input) = match (state, input, given) {
            (None, Some(_), _) => return Err(self.tensors.missing(&Role::StateScaling)),
            (None, None, None) => return Ok(self.options.scaling.clone()),
            (None, None, Some(_)) => {
                let expected = "--scaling, or a tensor scaling.state or std.state";
                return refused("--input-scaling", "factors of the inputs alone", expected);
            }
            (Some(_), Some(_), Some(_)) => {
                let found = "factors here and in a tensor";
                return refused("--input-scaling", found, "one of the two");
            }
            (Some(state), Some(input), None) => (state, self.factors(input)?),
            (Some(state), None, Some(given)) => (state, given),
            (Some(state), None, None) => {
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
            let is_usable = |&v: &f64| v > 0.0 && (1.0 / v).is_finite();
            if let Some(index) = values.iter().position(|v| !is_usable(v)) {
                let (place, found) = (assigned.place(&[index]), values[index].to_string());
                let expected =
                    "a positive standard deviation (1 for a coordinate that never moved)";
                return Err(self.tensors.refused(place, found, expected));
            }
            values.apply(|value| *value = 1.0 / *value);
        }
        Ok(match dim {
            1 => ScaleFactors::Uniform(values[0]),
            _ => ScaleFactors::PerCoordinate(values),
        })
    }

    /// Takes the mean that the training subtracted into the biases: of `E(s (x - m))` and `D(z) / s + m` to `E'(s x)`
    /// and `D'(z) / s`.
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
        self.change_ends(
            parts,
            |first| {
                let bias = first.bias() - first.weights() * &offset;
                (first.weights().clone(), bias)
            },
            |last| (last.weights().clone(), last.bias() + &offset),
        )?;
        let note = "the mean of the training's states went into the biases";
        self.report.notes.push(note.to_owned());
        Ok(())
    }

    /// Changes weights and bias of the layers on the robot's side: the encoder's first, the decoder's last.
    fn change_ends(
        &self,
        parts: &mut Parts,
        of_encoder: impl Fn(&AffineMap) -> (DMatrix<f64>, DVector<f64>),
        of_decoder: impl Fn(&AffineMap) -> (DMatrix<f64>, DVector<f64>),
    ) -> Result<(), ImportError> {
        let changed = |map: &StateMap, end: usize, (weights, bias)| {
            let mut layers = map.layers().to_vec();
            layers[end].map = AffineMap::new("layer", weights, bias)?;
            StateMap::new("map", layers)
        };
        if let Some(map) = &mut parts.encoder {
            let first = of_encoder(&map.layers()[0].map);
            *map = changed(map, 0, first).map_err(|source| self.unusable(source))?;
        }
        if let Some(map) = &mut parts.decoder {
            let end = map.layers().len() - 1;
            let last = of_decoder(&map.layers()[end].map);
            *map = changed(map, end, last).map_err(|source| self.unusable(source))?;
        }
        Ok(())
    }

    /// Brings everything that is over the robot's coordinates into the robot's order.
    pub(super) fn sort(&mut self, parts: &mut Parts) -> Result<(), ImportError> {
        let Some(order) = &self.options.order else {
            return Ok(());
        };
        let dim = parts.state_dim();
        if dim != Some(STATE_DIM) {
            let found = match dim {
                None => "no encoder or decoder".to_owned(),
                Some(dim) => format!("an encoder or decoder of {dim} coordinates"),
            };
            let expected = "one of 18 coordinates";
            return Err(ImportError::option("--order", found, expected));
        }
        self.change_ends(
            parts,
            |first| {
                let weights = order.sorted(&first.weights().transpose()).transpose();
                (weights, first.bias().clone())
            },
            |last| (order.sorted(last.weights()), order.sorted(last.bias())),
        )?;
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
            let rows = order.sorted(&statistics.covariance);
            statistics.mean = order.sorted(&statistics.mean);
            statistics.covariance = order.sorted(&rows.transpose()).transpose();
        }
        let note = format!("coordinates were in the order {order}; the model has romc's");
        self.report.notes.push(note);
        Ok(())
    }
}
