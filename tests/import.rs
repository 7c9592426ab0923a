//! Models trained elsewhere: every way to store one gives the same model, every fault is told.
//!
//! `fixtures/import` holds files that NumPy, safetensors and PySINDy wrote: `make.py` there says
//! how.

#[path = "import/command.rs"]
mod command;
mod command_line;
#[path = "import/equations.rs"]
mod equations;
#[path = "import/faults.rs"]
mod faults;
#[path = "import/foreign.rs"]
mod foreign;
#[path = "import/formats.rs"]
mod formats;
#[path = "import/hostile.rs"]
mod hostile;
#[path = "import/latex.rs"]
mod latex;
#[path = "import/library_order.rs"]
mod library_order;
#[path = "import/names.rs"]
mod names;
#[path = "import/round_trip.rs"]
mod round_trip;
#[path = "import/store.rs"]
mod store;
#[path = "import/terms.rs"]
mod terms;
mod tools;
#[path = "import/trained.rs"]
mod trained;
