//! The native half of the Python package: the functions of `romc` on NumPy arrays.
//!
//! The other half, `python/romc`, has the classes that users see and their documentation; it turns
//! their arguments into contiguous arrays and lists for these functions.
//! Long calls let other Python threads run.

mod arrays;
mod command;
mod controller;
mod emission;
mod errors;
mod identification;
mod model;
mod plan;
mod recording;
mod shipped;
mod simplification;
mod simulation;
mod tensors;

use pyo3::prelude::*;

/// The native module of the package.
#[pymodule]
fn _romc(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<controller::Controller>()?;
    module.add_class::<model::Model>()?;
    module.add_class::<recording::Recording>()?;
    module.add_class::<recording::Segment>()?;
    for function in [
        wrap_pyfunction!(command::command, module)?,
        wrap_pyfunction!(command::run_command, module)?,
        wrap_pyfunction!(controller::statuses, module)?,
        wrap_pyfunction!(emission::emit, module)?,
        wrap_pyfunction!(emission::equations, module)?,
        wrap_pyfunction!(emission::equations_text, module)?,
        wrap_pyfunction!(emission::write_files, module)?,
        wrap_pyfunction!(identification::identify, module)?,
        wrap_pyfunction!(plan::plan, module)?,
        wrap_pyfunction!(plan::walk, module)?,
        wrap_pyfunction!(recording::from_arrays, module)?,
        wrap_pyfunction!(recording::guess, module)?,
        wrap_pyfunction!(recording::read, module)?,
        wrap_pyfunction!(shipped::shipped_model, module)?,
        wrap_pyfunction!(shipped::shipped_models, module)?,
        wrap_pyfunction!(shipped::shipped_recordings, module)?,
        wrap_pyfunction!(simplification::simplify, module)?,
        wrap_pyfunction!(simulation::predict, module)?,
        wrap_pyfunction!(simulation::score, module)?,
        wrap_pyfunction!(simulation::simulate, module)?,
        wrap_pyfunction!(tensors::import_tensors, module)?,
    ] {
        module.add_function(function)?;
    }
    Ok(())
}
