//! Encoder and decoder from the tensors of their layers, with scale factors, means and the order of coordinates.

use super::*;
use crate::import::role::without_tensorflow_end;
use crate::model::{AffineMap, Layer};

/// How much decoding and encoding may change latent states without a note.
const LARGEST_CHANGE: f64 = 0.5;

type Tensors<'a> = (&'a Assigned<'a>, Option<&'a Assigned<'a>>);

impl<'a> Assembly<'a, '_> {
    pub(super) fn maps(&mut self) -> Read<(Option<StateMap>, Option<StateMap>)> {
        let maps = (self.map(Part::Encoder)?, self.map(Part::Decoder)?);
        let is_deep = |map: &StateMap| map.layers().len() > 1;
        if let Some(activation) = self.options.activation
            && !maps.0.iter().chain(&maps.1).any(is_deep)
        {
            let found = format!("{activation}, but no map with several layers");
            let expected = "tensors of layers, such as encoder.0.weight and encoder.2.weight";
            return Err(ImportError::option("--activation", found, expected));
        }
        let has = |layout| {
            let mut used = self.report.used.iter();
            used.any(|used| used.layout == layout && used.role.ends_with(".weight"))
        };
        if has(Layout::Row) && has(Layout::Column) {
            self.note("encoder and decoder are stored in different ways, one for row and one for column vectors");
        }
        if let (Some(encoder), Some(decoder)) = &maps {
            let change = self.change(encoder, decoder)?;
            if change > LARGEST_CHANGE {
                self.note(format!(
                    "encode(decode(z)) differs from z by {change:.2} of its size: are encoder and decoder those of one \
                     training?"
                ));
            }
        }
        Ok(maps)
    }

    /// How much `encode(decode(z))` changes steps from `z = 0` along each coordinate, relative to them.
    fn change(&self, encoder: &StateMap, decoder: &StateMap) -> Read<f64> {
        let dim = decoder.input_dim();
        let change = |index: Option<usize>| {
            let z = DVector::from_fn(dim, |k, _| f64::from(Some(k) == index));
            let back = (decoder.apply(&z)).and_then(|x| encoder.apply(&x));
            back.map(|back| back - z)
                .map_err(|source| self.unusable(source))
        };
        let origin = change(None)?;
        let mut sum = 0.0;
        for index in 0..dim {
            sum += (change(Some(index))? - &origin).norm_squared();
        }
        Ok((sum / dim as f64).sqrt())
    }

    fn layers(&self, part: Part) -> Read<Vec<Tensors<'a>>> {
        let mut layers: Vec<Tensors<'a>> = Vec::new();
        for assigned in &self.assignment.used {
            match assigned.role {
                Role::Weights(found, number) if found == part => {
                    layers.push((assigned, self.find(&Role::Bias(part, number))));
                }
                Role::Bias(found, number) if found == part => {
                    let weights = Role::Weights(part, number);
                    (self.find(&weights)).ok_or_else(|| self.tensors.missing(&weights))?;
                }
                _ => {}
            }
        }
        let is_mixed = layers.len() > 1 && layers[0].0.role == Role::Weights(part, None);
        if layers.len() > 1 && (is_mixed || self.options.activation.is_none()) {
            let name = part.name();
            let found = format!("{}, the layers of a deeper {name}", described(&layers));
            let expected = match is_mixed {
                true => format!("numbers for all of them, or one with --map {name}.weight=TENSOR"),
                false => "one linear layer, or --activation NAME (elu, relu, gelu, silu, softplus, tanh, \
                          sigmoid) for the activation between them"
                    .to_owned(),
            };
            return Err(self.tensors.refused(Place::Whole, found, expected));
        }
        Ok(layers)
    }

    /// Encoder or decoder: the activation after each layer but the last.
    fn map(&mut self, part: Part) -> Read<Option<StateMap>> {
        let tensors = self.layers(part)?;
        let part_name = part.name();
        let Some(last) = tensors.len().checked_sub(1) else {
            let lost = match part {
                Part::Encoder => "the model has latent coordinates only",
                Part::Decoder => "latent states cannot be mapped back",
            };
            let weights = format!("{part_name}.weight");
            self.note(format!(
                "no tensor {weights}, and no --map {weights}=TENSOR: {lost}"
            ));
            return Ok(None);
        };
        let is_deep = last > 0;
        let layout = self.orientation(part, &tensors)?;
        let mut layers = Vec::with_capacity(tensors.len());
        for (place, &(assigned, bias)) in tensors.iter().enumerate() {
            let shape = shape_of(part, assigned).expect("the orientation is of matrices");
            let matrix = self.read(assigned, shape, layout)?;
            let bias = match bias {
                Some(bias) => self.list(bias, matrix.nrows())?,
                None => {
                    self.note(format!("the {part_name} has no bias: zero"));
                    DVector::zeros(matrix.nrows())
                }
            };
            let name = match is_deep {
                true => format!("{part_name}.layers[{place}]"),
                false => part_name.to_owned(),
            };
            let map = AffineMap::new(&name, matrix, bias);
            let map = map.map_err(|source| self.unusable(source))?;
            let activation = match self.options.activation {
                Some(activation) if place < last => activation,
                _ => Activation::Linear,
            };
            layers.push(Layer { map, activation });
        }
        let map = StateMap::new(part_name, layers).map_err(|source| self.unusable(source))?;
        if is_deep {
            self.note(format!("the {part_name} has layers {}", map.summary()));
        }
        Ok(Some(map))
    }

    /// How the weights are stored: so that layers fit each other and `d <= n` coordinates leave an encoder.
    fn orientation(&mut self, part: Part, layers: &[Tensors<'_>]) -> Read<Layout> {
        let first = layers[0].0;
        let shapes = layers.iter().map(|(assigned, _)| shape_of(part, assigned));
        let shapes: Vec<(usize, usize)> = shapes.collect::<Option<_>>().unwrap_or_default();
        let are_kernels = (layers.iter()).all(|(assigned, _)| is_kernel(&assigned.info.name));
        let given = self.options.weights;
        let ways = match given.or(are_kernels.then_some(WeightVectors::Row)) {
            _ if first.info.shape.len() == 1 => &[Layout::Plain][..],
            Some(WeightVectors::Column) => &[Layout::Column],
            Some(WeightVectors::Row) => &[Layout::Row],
            None => &[Layout::Column, Layout::Row],
        };
        let known = |&layout| Some((layout, dims(part, &shapes, layout, self.known)?));
        let fitting: Vec<(Layout, Known)> = ways.iter().filter_map(known).collect();
        let ends = if part == Part::Encoder {
            "n to d"
        } else {
            "d to n"
        };
        let expected = || match (layers, part) {
            ([_], _) => self.expected_weights(part, are_kernels),
            _ => format!(
                "layers from {ends}, each with the outputs of the previous one as inputs, among {}",
                described(layers)
            ),
        };
        let option = "--weights column for z = W x (torch.nn.Linear) or --weights row for z = x W \
                      (TensorFlow)";
        let (layout, known) = self.only_way(first, &fitting, expected, option)?;
        self.known = known;
        Ok(layout)
    }

    fn expected_weights(&self, part: Part, are_kernels: bool) -> String {
        let Known { latent, state } = self.known;
        let bound = match (latent, state) {
            (Some(_), Some(_)) => "",
            _ => ", with d at most n",
        };
        let (d, n) = (text_or(latent, "d"), text_or(state, "n"));
        let (outputs, inputs) = match part {
            Part::Encoder => (d, n),
            Part::Decoder => (n, d),
        };
        let column = format!("{outputs} x {inputs}");
        let row = format!("{inputs} x {outputs}");
        match self.options.weights {
            Some(WeightVectors::Column) => format!("{column} (--weights column){bound}"),
            Some(WeightVectors::Row) => format!("{row} (--weights row){bound}"),
            None if are_kernels => {
                format!("{row} (row vectors, as Keras and Flax keep a kernel){bound}")
            }
            None => format!("{column} (column vectors) or {row} (row vectors){bound}"),
        }
    }
}

/// Whether weights are for row vectors by their name: Keras and Flax name theirs so.
fn is_kernel(name: &str) -> bool {
    without_tensorflow_end(name).ends_with("kernel")
}

fn described(layers: &[Tensors<'_>]) -> String {
    let texts: Vec<String> = layers.iter().map(|(a, _)| a.info.describe()).collect();
    texts.join(", ")
}

/// Rows and columns as stored; a list is the only row of an encoder or the only column of a decoder.
fn shape_of(part: Part, assigned: &Assigned<'_>) -> Option<(usize, usize)> {
    match (&assigned.info.shape[..], part) {
        (&[rows, columns], _) => Some((rows, columns)),
        (&[length], Part::Encoder) => Some((1, length)),
        (&[length], Part::Decoder) => Some((length, 1)),
        _ => None,
    }
}

/// Latent and state dimension if the layers, stored in this way, are a chain that fits.
fn dims(part: Part, shapes: &[(usize, usize)], layout: Layout, known: Known) -> Option<Known> {
    let widths = shapes.iter().map(|&(rows, columns)| match layout {
        Layout::Row => (rows, columns),
        _ => (columns, rows),
    });
    let widths: Vec<(usize, usize)> = widths.collect();
    let is_chain = widths.windows(2).all(|pair| pair[0].1 == pair[1].0);
    let (first, last) = (widths.first()?.0, widths.last()?.1);
    let (latent, state) = match part {
        Part::Encoder => (last, first),
        Part::Decoder => (first, last),
    };
    let fits = is_chain
        && (1..=state).contains(&latent)
        && known.latent.is_none_or(|known| known == latent)
        && known.state.is_none_or(|known| known == state);
    let (latent, state) = (Some(latent), Some(state));
    fits.then_some(Known { latent, state })
}

impl<'a> Assembly<'a, '_> {
    /// Scale factors from tensors, or as given; in the file's order.
    pub(super) fn scaling(&mut self) -> Read<Option<Scaling>> {
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

    fn one_of(&self, factor: &Role, deviation: &Role) -> Read<Option<&'a Assigned<'a>>> {
        match (self.find(factor), self.find(deviation)) {
            (Some(_), Some(other)) => {
                let found = format!("{deviation} together with {factor}");
                Err(self.refused(other, found, "one of the two"))
            }
            (one, None) | (None, one) => Ok(one),
        }
    }

    fn factors(&mut self, assigned: &Assigned<'_>) -> Read<ScaleFactors> {
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

    /// Adds the subtracted mean to the biases: `E(s (x - m))` and `D(z) / s + m` become `E'(s x)` and `D'(z) / s`.
    pub(super) fn fold_mean(&mut self, parts: &mut Parts) -> Read<()> {
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
        self.note("the mean of the training's states went into the biases");
        Ok(())
    }

    /// Changes weights and bias of the layers on the robot's side: the encoder's first, the decoder's last.
    fn change_ends(
        &self,
        parts: &mut Parts,
        of_encoder: impl Fn(&AffineMap) -> (DMatrix<f64>, DVector<f64>),
        of_decoder: impl Fn(&AffineMap) -> (DMatrix<f64>, DVector<f64>),
    ) -> Read<()> {
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
    pub(super) fn sort(&mut self, parts: &mut Parts) -> Read<()> {
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
        self.note(format!(
            "coordinates were in the order {order}; the model has romc's"
        ));
        Ok(())
    }
}
