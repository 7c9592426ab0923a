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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn first_step_has_the_length_of_the_learning_rate() {
        let mut values = [1.0, -2.0];
        Adam::new(2, 0.1).step(&mut values, &[5.0, -1e-3]);
        assert!(
            (values[0] - 0.9).abs() < 1e-6 && (values[1] + 1.9).abs() < 1e-4,
            "{values:?}"
        );
    }

    #[test]
    fn repeated_steps_find_the_minimum_of_a_parabola() {
        let mut values = [3.0];
        let mut adam = Adam::new(1, 0.05);
        for _ in 0..2000 {
            let gradient = [2.0 * (values[0] - 0.5)];
            adam.step(&mut values, &gradient);
        }
        assert!((values[0] - 0.5).abs() < 1e-3, "{values:?}");
    }
}
