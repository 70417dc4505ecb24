//! Help made from the definitions of the command line: completions for shells, manual pages, and what was
//! meant where no command was typed.

use super::arguments::{Arguments, CompletionsArguments, ManArguments};
use super::failure::Failure;
use clap::{Command, CommandFactory};
use std::ffi::{OsStr, OsString};
use std::io::{self, Write};
use std::path::Path;

/// Prints the script which lets a shell complete options and names.
pub fn completions(arguments: &CompletionsArguments) -> Result<(), Failure> {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut Arguments::command(), "kinora", &mut script);
    print(&script)
}

/// Prints the manual page of the program or of one of its commands.
pub fn man(arguments: &ManArguments) -> Result<(), Failure> {
    let mut program = Arguments::command().disable_help_subcommand(true);
    program.build();
    let page = match &arguments.command {
        None => program,
        Some(name) => command(&program, name)?,
    };
    let mut text = Vec::new();
    clap_mangen::Man::new(page).render(&mut text)?;
    print(&text)
}

fn command(program: &Command, name: &str) -> Result<Command, Failure> {
    program.find_subcommand(name).cloned().ok_or_else(|| {
        let names: Vec<&str> = program.get_subcommands().map(Command::get_name).collect();
        Failure::Usage(format!("there is no command `{name}`; there are {}", names.join(", ")))
    })
}

fn print(text: &[u8]) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    out.write_all(text)?;
    out.flush()?;
    Ok(())
}

/// What was probably meant by words (without the program's name) among which is no command: a scene is there
/// to be rendered.
pub fn meant(words: &[OsString]) -> Option<String> {
    let program = Arguments::command();
    if words.iter().any(|word| word.to_str().is_some_and(|w| program.find_subcommand(w).is_some()))
    {
        return None;
    }
    words.iter().find(|word| is_scene(word))?;
    let words: Vec<String> = words.iter().map(|word| quoted(&word.to_string_lossy())).collect();
    Some(format!("kinora render {}", words.join(" ")))
}

fn is_scene(word: &OsStr) -> bool {
    let path = Path::new(word);
    word == "-" || path.extension().is_some_and(|name| name == "ron") || path.is_file()
}

/// A word as a shell takes it.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "-_./=,:@%+".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        return word.to_owned();
    }
    format!("'{}'", word.replace('\'', r"'\''"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn meant_by(words: &[&str]) -> Option<String> {
        meant(&words.iter().map(OsString::from).collect::<Vec<_>>())
    }

    #[test]
    fn a_scene_without_a_command_is_to_be_rendered() {
        let render = |rest: &str| Some(format!("kinora render {rest}"));
        assert_eq!(meant_by(&["scenes/ball.ron"]), render("scenes/ball.ron"));
        assert_eq!(meant_by(&["-f", "3", "my ball.ron"]), render("-f 3 'my ball.ron'"));
        assert_eq!(meant_by(&["it's.ron"]), render(r"'it'\''s.ron'"));
        assert_eq!(meant_by(&["paint"]), None);
        assert_eq!(meant_by(&["check", "scenes/ball.ron", "--wrong"]), None);
    }

    #[test]
    fn every_command_has_a_manual_page_and_every_shell_its_completions() {
        let program = Arguments::command();
        for name in program.get_subcommands().map(Command::get_name) {
            assert_eq!(command(&program, name).expect("it is there").get_name(), name);
        }
        for shell in clap::ValueEnum::value_variants() {
            let mut script = Vec::new();
            let shell: clap_complete::Shell = *shell;
            clap_complete::generate(shell, &mut Arguments::command(), "kinora", &mut script);
            let script = String::from_utf8(script).expect("UTF-8");
            assert!(script.contains("integrator") && script.contains("develop"), "{shell}");
        }
    }
}
