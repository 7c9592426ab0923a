//! Models trained elsewhere, by the command and along recordings; `import/units.rs` has the ways to store them.

#[path = "import/command.rs"]
mod command;
mod command_line;
#[path = "import/formats.rs"]
mod formats;
#[path = "import/library_order.rs"]
mod library_order;
#[path = "import/store.rs"]
mod store;
mod tools;
#[path = "import/trained.rs"]
mod trained;
