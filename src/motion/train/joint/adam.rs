//! The Adam optimiser (Kingma and Ba 2015) on one block of numbers.

#[derive(Clone, Debug)]
pub struct Adam {
    learning_rate: f64,
    mean: Vec<f64>,
    square: Vec<f64>,
    steps: i32,
}

const BETA_MEAN: f64 = 0.9;
const BETA_SQUARE: f64 = 0.999;
/// The value of TensorFlow, which the published models were trained with.
const EPSILON: f64 = 1e-7;

impl Adam {
    pub fn new(len: usize, learning_rate: f64) -> Self {
        Self {
            learning_rate,
            mean: vec![0.0; len],
            square: vec![0.0; len],
            steps: 0,
        }
    }

    pub fn step(&mut self, values: &mut [f64], gradient: &[f64]) {
        self.steps = self.steps.saturating_add(1);
        let mean_correction = 1.0 - BETA_MEAN.powi(self.steps);
        let square_correction = 1.0 - BETA_SQUARE.powi(self.steps);
        let rate = self.learning_rate * square_correction.sqrt() / mean_correction;
        let epsilon = EPSILON * square_correction.sqrt();
        let moments = self.mean.iter_mut().zip(&mut self.square);
        for ((value, g), (mean, square)) in values.iter_mut().zip(gradient).zip(moments) {
            *mean += (1.0 - BETA_MEAN) * (g - *mean);
            *square += (1.0 - BETA_SQUARE) * (g * g - *square);
            *value -= rate * *mean / (square.sqrt() + epsilon);
        }
    }
}
