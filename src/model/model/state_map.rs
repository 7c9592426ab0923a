//! Chains of affine layers with activations: encoders and decoders, linear or not.
//!
//! With `a_k = W_k y_(k-1) + b_k` and `y_k = phi_k(a_k)`, the map is `y_0 -> y_L`; its Jacobian is
//! `J = D_L W_L ... D_1 W_1` with `D_k = diag(phi_k'(a_k))`. An affine map is the chain of one linear layer.

use super::*;
use crate::limits::table;

pub const MAX_LAYERS: usize = 16;
const MAX_LAYER_WIDTH: usize = table::LAYER_WIDTH.most as usize;

/// `x -> W x + b` in scaled units; the bias is not added to velocities and accelerations.
#[derive(Clone, Debug, PartialEq)]
pub struct AffineMap {
    weights: DMatrix<f64>,
    bias: DVector<f64>,
}

impl AffineMap {
    pub fn new(tensor: &str, weights: DMatrix<f64>, bias: DVector<f64>) -> Result<Self> {
        let map = Self { weights, bias };
        map.check(tensor)?;
        Ok(map)
    }

    fn check(&self, tensor: &str) -> Result<()> {
        let bias_name = format!("{tensor}.bias");
        check_shape(&bias_name, self.bias.shape(), (self.weights.nrows(), 1))?;
        check_finite(&format!("{tensor}.weights"), &self.weights)?;
        check_finite(&bias_name, &self.bias)
    }

    pub fn weights(&self) -> &DMatrix<f64> {
        &self.weights
    }

    pub fn bias(&self) -> &DVector<f64> {
        &self.bias
    }

    pub fn input_dim(&self) -> usize {
        self.weights.ncols()
    }

    pub fn output_dim(&self) -> usize {
        self.weights.nrows()
    }

    fn apply(&self, x: &DVector<f64>) -> Result<DVector<f64>> {
        Ok(self.apply_linear(x)? + &self.bias)
    }

    fn apply_linear(&self, dx: &DVector<f64>) -> Result<DVector<f64>> {
        ModelError::check_dimension("argument of an affine map", dx.len(), self.input_dim())?;
        Ok(&self.weights * dx)
    }
}

/// One layer: `y -> phi(W y + b)`, the activation applied to each unit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "LayerKeys", into = "LayerKeys")]
pub struct Layer {
    pub map: AffineMap,
    pub activation: Activation,
}

/// A smooth map between scaled coordinates: an encoder or a decoder.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "MapKeys", into = "MapKeys")]
pub struct StateMap {
    /// Those of a map from a file are checked with its model.
    layers: Vec<Layer>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct LayerKeys {
    #[serde(with = "listed")]
    weights: DMatrix<f64>,
    #[serde(with = "listed")]
    bias: DVector<f64>,
    #[serde(default)]
    activation: Activation,
}

impl From<LayerKeys> for Layer {
    fn from(keys: LayerKeys) -> Self {
        let (weights, bias, activation) = (keys.weights, keys.bias, keys.activation);
        let map = AffineMap { weights, bias };
        Self { map, activation }
    }
}

impl From<Layer> for LayerKeys {
    fn from(layer: Layer) -> Self {
        let AffineMap { weights, bias } = layer.map;
        let activation = layer.activation;
        Self {
            weights,
            bias,
            activation,
        }
    }
}

#[derive(Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct MapKeys {
    #[serde(with = "listed", skip_serializing_if = "Option::is_none")]
    weights: Option<DMatrix<f64>>,
    #[serde(with = "listed", skip_serializing_if = "Option::is_none")]
    bias: Option<DVector<f64>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    layers: Option<Vec<Layer>>,
}

impl TryFrom<MapKeys> for StateMap {
    type Error = &'static str;

    fn try_from(keys: MapKeys) -> Result<Self, &'static str> {
        match (keys.weights, keys.bias, keys.layers) {
            (None, None, Some(layers)) => Ok(Self { layers }),
            (_, _, Some(_)) => {
                Err("found `layers` together with `weights` or `bias`, expected one of the two")
            }
            (Some(weights), Some(bias), None) => Ok(AffineMap { weights, bias }.into()),
            (None, _, None) => Err("missing field `weights`"),
            (_, None, None) => Err("missing field `bias`"),
        }
    }
}

impl From<StateMap> for MapKeys {
    fn from(map: StateMap) -> Self {
        match map.as_affine().cloned() {
            Some(AffineMap { weights, bias }) => Self {
                weights: Some(weights),
                bias: Some(bias),
                layers: None,
            },
            None => Self {
                layers: Some(map.layers),
                ..Self::default()
            },
        }
    }
}

impl From<AffineMap> for StateMap {
    fn from(map: AffineMap) -> Self {
        let activation = Activation::Linear;
        Self {
            layers: vec![Layer { map, activation }],
        }
    }
}

impl From<AffineMap> for Option<StateMap> {
    fn from(map: AffineMap) -> Self {
        Some(map.into())
    }
}

impl StateMap {
    pub fn new(tensor: &str, layers: Vec<Layer>) -> Result<Self> {
        let map = Self { layers };
        map.check_chain(tensor)?;
        Ok(map)
    }

    pub(super) fn check_chain(&self, tensor: &str) -> Result<()> {
        let (place, n_layers) = (format!("`{tensor}.layers`"), self.layers.len());
        check_count(&place, n_layers, "layers", 1..=MAX_LAYERS)?;
        if let Some(affine) = self.as_affine() {
            return affine.check(tensor);
        }
        let mut columns = self.input_dim();
        for (index, layer) in self.layers.iter().enumerate() {
            let name = format!("{tensor}.layers[{index}]");
            layer.map.check(&name)?;
            let (found, rows) = (layer.map.weights.shape(), layer.map.output_dim());
            let place = format!("`{name}.weights`");
            let expected = format!("at most {MAX_LAYER_WIDTH}");
            let fits = rows <= MAX_LAYER_WIDTH;
            check(fits, &place, || format!("{rows} units"), expected)?;
            check_shape(&format!("{name}.weights"), found, (rows, columns))?;
            columns = rows;
        }
        Ok(())
    }

    pub fn layers(&self) -> &[Layer] {
        &self.layers
    }

    pub fn as_affine(&self) -> Option<&AffineMap> {
        match self.layers.as_slice() {
            [only] if only.activation == Activation::Linear => Some(&only.map),
            _ => None,
        }
    }

    pub fn input_dim(&self) -> usize {
        self.layers[0].map.input_dim()
    }

    pub fn output_dim(&self) -> usize {
        self.layers[self.layers.len() - 1].map.output_dim()
    }

    pub fn apply(&self, x: &DVector<f64>) -> Result<DVector<f64>> {
        let mut layers = self.layers.iter();
        layers.try_fold(x.clone(), |y, layer| {
            Ok((layer.map.apply(&y)?).map(|a| layer.activation.value(a)))
        })
    }

    /// `y`, `J(x) dx` and `J(x) ddx + dJ/dt dx`: each layer maps `ddy -> phi''(a) (W dy)^2 + phi'(a) W ddy`.
    pub fn apply_rates(
        &self,
        x: &DVector<f64>,
        dx: &DVector<f64>,
        ddx: &DVector<f64>,
    ) -> Result<[DVector<f64>; 3]> {
        let (mut y, mut dy, mut ddy) = (x.clone(), dx.clone(), ddx.clone());
        for layer in &self.layers {
            let a = layer.map.apply(&y)?;
            let da = layer.map.apply_linear(&dy)?;
            let dda = layer.map.apply_linear(&ddy)?;
            let phi = layer.activation;
            ddy = DVector::from_fn(a.len(), |i, _| {
                phi.curvature(a[i]) * da[i] * da[i] + phi.slope(a[i]) * dda[i]
            });
            dy = da.zip_map(&a, |da, a| phi.slope(a) * da);
            y = a.map(|a| phi.value(a));
        }
        Ok([y, dy, ddy])
    }

    pub fn jacobian(&self, x: &DVector<f64>) -> Result<DMatrix<f64>> {
        let mut y = x.clone();
        let mut jacobian = None;
        for layer in &self.layers {
            let a = layer.map.apply(&y)?;
            let mut product = match jacobian {
                None => layer.map.weights().clone(),
                Some(before) => layer.map.weights() * before,
            };
            for (mut row, &a) in product.row_iter_mut().zip(&a) {
                row *= layer.activation.slope(a);
            }
            jacobian = Some(product);
            y = a.map(|a| layer.activation.value(a));
        }
        Ok(jacobian.expect("a map has a layer"))
    }

    /// Checks the dimensions at the first and the last layer; `expected` is the Jacobian's shape.
    pub(super) fn check(&self, name: &str, expected: (usize, usize)) -> Result<()> {
        if let Some(affine) = self.as_affine() {
            let (tensor, found) = (format!("{name}.weights"), affine.weights().shape());
            return check_shape(&tensor, found, expected);
        }
        let last = self.layers.len() - 1;
        let ends = [(0, None, Some(expected.1)), (last, Some(expected.0), None)];
        for (layer, rows, columns) in ends {
            let found = self.layers[layer].map.weights().shape();
            let expected = (rows.unwrap_or(found.0), columns.unwrap_or(found.1));
            check_shape(&format!("{name}.layers[{layer}].weights"), found, expected)?;
        }
        Ok(())
    }

    /// No layer of an encoder may be narrower than the latent space, or its Jacobian never has full rank.
    pub(super) fn check_widths(&self, latent_dim: usize) -> Result<()> {
        let widths = self.layers.iter().map(|layer| layer.map.output_dim());
        for (layer, width) in widths.enumerate() {
            let (place, found) = (format!("`encoder.layers[{layer}]`"), || {
                format!("{width} units")
            });
            let expected = format!("at least {latent_dim}, one per latent coordinate");
            check(width >= latent_dim, &place, found, expected)?;
        }
        Ok(())
    }

    /// The layers in words: `18 -> 32 elu -> 4`.
    pub fn summary(&self) -> String {
        let mut text = self.input_dim().to_string();
        for layer in &self.layers {
            text.push_str(&format!(" -> {}", layer.map.output_dim()));
            if layer.activation != Activation::Linear {
                text.push_str(&format!(" {}", layer.activation));
            }
        }
        text
    }
}
