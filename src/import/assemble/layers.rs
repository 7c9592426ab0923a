//! Several layers of a network to one map.

use nalgebra::DVector;

use super::super::assign::Assigned;
use super::super::error::ImportError;
use super::super::layout::{Known, Subject};
use super::super::options::WeightVectors;
use super::super::report::{Layout, Note};
use super::super::role::{Part, Role};
use super::Assembly;
use crate::model::{Activation, AffineMap, Layer, StateMap};

/// Widths of a layer's input and output.
type Widths = (usize, usize);

impl<'f> Assembly<'_, 'f> {
    /// The tensors of a map's layers in their order; none if it has one layer at most.
    pub(super) fn layers_of(&self, part: Part) -> Vec<Assigned<'f>> {
        let is_layer = |assigned: &&Assigned<'f>| match assigned.role {
            Role::LayerWeights(found, _) => found == part,
            _ => false,
        };
        let mut layers: Vec<Assigned<'f>> = (self.assignment.used.iter())
            .filter(is_layer)
            .cloned()
            .collect();
        layers.sort_by(|a, b| a.role.cmp(&b.role));
        layers
    }

    /// Encoder or decoder from several layers: `activation` after each but the last.
    pub(super) fn network(
        &mut self,
        part: Part,
        tensors: &[Assigned<'f>],
        activation: Activation,
    ) -> Result<StateMap, ImportError> {
        let layout = self.orientation(part, tensors)?;
        let mut layers = Vec::with_capacity(tensors.len());
        for (place, assigned) in tensors.iter().enumerate() {
            let stored = self.read(assigned)?;
            let (rows, cols) = (assigned.info.shape[0], assigned.info.shape[1]);
            let matrix = stored.matrix(rows, cols);
            let matrix = match layout {
                Layout::Row => matrix.transpose(),
                _ => matrix,
            };
            self.tell(assigned, layout);
            let number = match assigned.role {
                Role::LayerWeights(_, number) => number,
                _ => place,
            };
            let bias = match self.find(&Role::LayerBias(part, number)) {
                Some(bias) => self.list(&bias, matrix.nrows())?,
                None => {
                    self.news.notes.push(Note::ZeroBias { part: part.name() });
                    DVector::zeros(matrix.nrows())
                }
            };
            let name = format!("{}.layers[{place}]", part.name());
            let map = AffineMap::new(&name, matrix, bias);
            let is_last = place + 1 == tensors.len();
            layers.push(Layer {
                map: map.map_err(|source| self.model_error(source))?,
                activation: match is_last {
                    true => Activation::Linear,
                    false => activation,
                },
            });
        }
        let map = StateMap::new(part.name(), layers).map_err(|source| self.model_error(source))?;
        self.news.notes.push(Note::Layers {
            part: part.name(),
            layers: map.summary(),
        });
        Ok(map)
    }

    /// How the weights are stored: the way in which each layer takes what the one before gives.
    fn orientation(&mut self, part: Part, tensors: &[Assigned<'f>]) -> Result<Layout, ImportError> {
        let first = &tensors[0];
        let role = first.role.to_string();
        let subject = |info| Subject {
            file: self.tensors.file(),
            info,
            role: &role,
        };
        let mut shapes: Vec<Widths> = Vec::with_capacity(tensors.len());
        for assigned in tensors {
            match assigned.info.shape[..] {
                [rows, columns] => shapes.push((rows, columns)),
                _ => return Err(subject(assigned.info).shape_error("a matrix".to_owned())),
            }
        }
        let wanted = match self.options.weights {
            Some(WeightVectors::Column) => vec![Layout::Column],
            Some(WeightVectors::Row) => vec![Layout::Row],
            None => vec![Layout::Column, Layout::Row],
        };
        let fitting: Vec<(Layout, Known)> = wanted
            .into_iter()
            .filter_map(|layout| Some((layout, ends(part, &shapes, layout, self.known)?)))
            .collect();
        match fitting[..] {
            [(layout, known)] => {
                self.known = known;
                Ok(layout)
            }
            [] => {
                let ends = match part {
                    Part::Encoder => "n to d",
                    Part::Decoder => "d to n",
                };
                let found: Vec<String> = tensors.iter().map(|a| a.info.describe()).collect();
                let expected = format!(
                    "layers from {ends}, each taking what the one before gives, among {}",
                    found.join(", ")
                );
                Err(subject(first.info).shape_error(expected))
            }
            _ => Err(subject(first.info).orientation_error(
                "--weights column for z = W x (torch.nn.Linear) or --weights row for z = x W \
                 (TensorFlow)",
            )),
        }
    }
}

/// Latent and state dimension if the layers, stored in this way, are a chain that fits.
fn ends(part: Part, shapes: &[Widths], layout: Layout, known: Known) -> Option<Known> {
    let widths: Vec<Widths> = (shapes.iter())
        .map(|&(rows, columns)| match layout {
            Layout::Row => (rows, columns),
            _ => (columns, rows),
        })
        .collect();
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
