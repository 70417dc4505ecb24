//! The command line: one file per command. It is a user of the library, no more.

mod arguments;
mod check;
mod develop;
mod engine;
mod failure;
mod format;
mod frames;
mod help;
mod interrupt;
mod progress;
mod render;
mod summary;
mod survey;

use arguments::{Arguments, Command};
use clap::Parser;
use failure::{Failure, INTERNAL, USAGE};
use progress::say;
use std::ffi::OsString;
use std::panic::{AssertUnwindSafe, PanicHookInfo, catch_unwind};
use std::process::ExitCode;

/// Runs the command that was typed and answers with its exit code.
pub fn main() -> ExitCode {
    std::panic::set_hook(Box::new(report_panic));
    let words: Vec<OsString> = std::env::args_os().collect();
    let arguments = match Arguments::try_parse_from(&words) {
        Ok(arguments) => arguments,
        Err(answer) => {
            let meant = help::meant(words.get(1..).unwrap_or_default());
            return match meant.filter(|_| answer.use_stderr()) {
                Some(meant) => {
                    say(&format!("error: no command was given\n\n  did you mean: {meant}"));
                    ExitCode::from(USAGE)
                }
                None => print_answer(&answer),
            };
        }
    };
    let outcome = catch_unwind(AssertUnwindSafe(|| match arguments.command {
        Command::Render(arguments) => render::run(&arguments),
        Command::Check(arguments) => check::run(&arguments),
        Command::Develop(arguments) => develop::run(&arguments),
        Command::Completions(arguments) => help::completions(&arguments),
        Command::Man(arguments) => help::man(&arguments),
    }));
    match outcome {
        Ok(Ok(())) => ExitCode::SUCCESS,
        Ok(Err(failure)) => {
            failure.print();
            ExitCode::from(failure.exit_code())
        }
        Err(_) => ExitCode::from(INTERNAL), // the hook has told about it
    }
}

/// Prints what was typed for: the help, the version, or what is wrong with the words (code 2).
fn print_answer(answer: &clap::Error) -> ExitCode {
    match answer.print() {
        Err(error) if !answer.use_stderr() => {
            let failure = Failure::from(error);
            failure.print();
            ExitCode::from(failure.exit_code())
        }
        _ => ExitCode::from(answer.exit_code() as u8),
    }
}

/// A panic is our mistake, never the user's: say so in short.
fn report_panic(info: &PanicHookInfo<'_>) {
    let place =
        info.location().map_or_else(String::new, |at| format!(" ({}:{})", at.file(), at.line()));
    let what = info.payload_as_str().unwrap_or("unknown");
    say(&format!(
        "internal error: {what}{place}\n\
         This is a mistake in kinora, not in your scene. Frames which are finished are kept.\n\
         Please report it with this message and, if you can, the scene."
    ));
}
