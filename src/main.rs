//! The `romc` binary: hands over to [`romc::cli::run`].

use std::process::ExitCode;

fn main() -> ExitCode {
    romc::cli::run()
}
