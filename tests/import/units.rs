//! Every way to store a model gives the same model, and every fault is reported.
//!
//! `fixtures/import` contains files written by NumPy, safetensors and PySINDy: see `make.py` there.

mod equations;
mod faults;
mod foreign;
mod hostile;
mod latex;
mod names;
mod round_trip;
mod store;
mod terms;
