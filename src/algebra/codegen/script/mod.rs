//! Languages that run scripts: NumPy, CasADi (`python`) and MATLAB or Octave (`matlab`).
//!
//! Arrays are matrices with a column a point, or a vector for one point, and every operation is
//! element by element, so that the statements of a program serve one state and many alike. What a
//! generated function writes into its parameters elsewhere is returned here.

mod functions;
pub mod matlab;
pub mod python;
