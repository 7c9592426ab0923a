//! Encoder and decoder from the tensors of their layers; a linear map is a single layer.

use nalgebra::DVector;

use super::super::ImportError;
use super::super::assign::Assigned;
use super::super::options::WeightVectors;
use super::super::report::Layout;
use super::super::role::{Part, Role, without_tensorflow_end};
use super::{Assembly, Known, text_or};
use crate::files::Place;
use crate::model::{Activation, AffineMap, Layer, StateMap};

/// How much decoding and encoding may change latent states without a note.
const LARGEST_CHANGE: f64 = 0.5;

type Tensors<'a> = (&'a Assigned<'a>, Option<&'a Assigned<'a>>);

impl<'a> Assembly<'a, '_> {
    pub(super) fn maps(&mut self) -> Result<(Option<StateMap>, Option<StateMap>), ImportError> {
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
            let note = "encoder and decoder are stored in different ways, one for row and one for column vectors";
            self.report.notes.push(note.to_owned());
        }
        if let (Some(encoder), Some(decoder)) = &maps {
            let change = self.change(encoder, decoder)?;
            if change > LARGEST_CHANGE {
                self.report.notes.push(format!(
                    "encode(decode(z)) differs from z by {change:.2} of its size: are encoder and decoder those of one \
                     training?"
                ));
            }
        }
        Ok(maps)
    }

    /// How much `encode(decode(z))` changes steps from `z = 0` along each coordinate, relative to them.
    fn change(&self, encoder: &StateMap, decoder: &StateMap) -> Result<f64, ImportError> {
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

    fn layers(&self, part: Part) -> Result<Vec<Tensors<'a>>, ImportError> {
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
                          sigmoid) to say what is between them"
                    .to_owned(),
            };
            return Err(self.tensors.refused(Place::Whole, found, expected));
        }
        Ok(layers)
    }

    /// Encoder or decoder: the activation after each layer but the last.
    fn map(&mut self, part: Part) -> Result<Option<StateMap>, ImportError> {
        let tensors = self.layers(part)?;
        let part_name = part.name();
        let Some(last) = tensors.len().checked_sub(1) else {
            let lost = match part {
                Part::Encoder => "the model has latent coordinates only",
                Part::Decoder => "latent states cannot be mapped back",
            };
            let weights = format!("{part_name}.weight");
            let note = format!("no tensor {weights}, and no --map {weights}=TENSOR: {lost}");
            self.report.notes.push(note);
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
                    let note = format!("the {part_name} has no bias: zero");
                    self.report.notes.push(note);
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
            let note = format!("the {part_name} has layers {}", map.summary());
            self.report.notes.push(note);
        }
        Ok(Some(map))
    }

    /// How the weights are stored: the way in which each layer takes what the one before gives, and `d <= n`
    /// coordinates leave an encoder. Every shape but a square decides.
    fn orientation(&mut self, part: Part, layers: &[Tensors<'_>]) -> Result<Layout, ImportError> {
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
        let known = |&layout| Some((layout, ends(part, &shapes, layout, self.known)?));
        let fitting: Vec<(Layout, Known)> = ways.iter().filter_map(known).collect();
        let expected = || match (layers, part) {
            ([_], _) => self.expected_weights(part, are_kernels),
            _ => format!(
                "layers from {}, each taking the outputs of the one before, among {}",
                if part == Part::Encoder {
                    "n to d"
                } else {
                    "d to n"
                },
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
        let (column, row) = (
            format!("{outputs} x {inputs}"),
            format!("{inputs} x {outputs}"),
        );
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
fn ends(part: Part, shapes: &[(usize, usize)], layout: Layout, known: Known) -> Option<Known> {
    // Numbers of inputs and outputs.
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
    fits.then_some(Known {
        latent: Some(latent),
        state: Some(state),
    })
}
