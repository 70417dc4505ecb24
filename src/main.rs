//! The program `kinora`: hands the words typed to [`cli`]; an error becomes an exit code.

mod cli;

use std::process::ExitCode;

fn main() -> ExitCode {
    cli::main()
}
