//! The reduced-order model: encoder, decoder, library, coefficients, phases.
