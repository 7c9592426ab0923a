//! The latent-space model-predictive controller.
