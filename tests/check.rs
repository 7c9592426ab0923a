//! `romc check`: models against their own print, mutated ones, papers typed by hand, and the command.

#[path = "check/command.rs"]
mod command;
mod command_line;
#[path = "check/domains.rs"]
mod domains;
#[path = "check/models.rs"]
mod models;
#[path = "check/papers.rs"]
mod papers;
#[allow(dead_code, reason = "no test here needs a tool")]
mod tools;
