//! Every way to store a model gives the same model, every fault is told.
//!
//! `fixtures/import` holds files that NumPy, safetensors and PySINDy wrote: `make.py` there says
//! how.

mod equations;
mod faults;
mod foreign;
mod hostile;
mod latex;
mod names;
mod round_trip;
mod store;
mod terms;
