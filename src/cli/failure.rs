//! What can go wrong in a command, and the exit code that says so.

use super::format::harmless;
use super::progress::{say, say_as_it_is};
use kinora::description::Diagnostics;
use kinora::output::OutputError;
use std::error::Error;
use std::io::{self, IsTerminal};
use std::path::PathBuf;

/// The scene or one of its files is wrong.
pub const SCENE: u8 = 1;
/// The command line asks for something impossible (`clap` uses the same code).
pub const USAGE: u8 = 2;
/// A mistake of ours.
pub const INTERNAL: u8 = 70;
/// A file could not be written (`EX_IOERR` of sysexits.h).
pub const IO: u8 = 74;
/// Stopped before the end, everything finished so far kept (`EX_TEMPFAIL` of sysexits.h).
pub const INTERRUPTED: u8 = 75;

/// Why a command did not do what was asked.
#[derive(Debug, thiserror::Error)]
pub enum Failure {
    /// Mistakes in the scene, already laid out with their places: plain, and with colours.
    #[error("{plain}")]
    Diagnostics { plain: String, styled: String },
    /// A mistake that shows only when the scene is put together.
    #[error("cannot render this scene")]
    Scene(#[source] Box<dyn Error + Send + Sync>),
    #[error("{0}")]
    Usage(String),
    /// A file that was named cannot be used.
    #[error("{0}")]
    Input(String),
    #[error(transparent)]
    Output(#[from] OutputError),
    #[error("cannot write to the standard output")]
    Stdout(#[from] io::Error),
    #[error(
        "interrupted: {finished} of {total} frames are finished and kept in {}\n\
         run the same command again to go on from there", .folder.display()
    )]
    Interrupted { finished: usize, total: usize, folder: PathBuf },
}

impl From<Diagnostics> for Failure {
    fn from(diagnostics: Diagnostics) -> Self {
        let (plain, styled) = (diagnostics.render(false), diagnostics.render(true));
        Self::Diagnostics { plain, styled }
    }
}

impl Failure {
    /// What the program returns to the shell.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Diagnostics { .. }
            | Self::Scene(_)
            | Self::Input(_)
            | Self::Output(OutputError::Read { .. } | OutputError::TooLarge { .. }) => SCENE,
            Self::Usage(_) => USAGE,
            // A reader that has seen enough, such as `head`, is no failure.
            Self::Stdout(error) if error.kind() == io::ErrorKind::BrokenPipe => 0,
            Self::Output(_) | Self::Stdout(_) => IO,
            Self::Interrupted { .. } => INTERRUPTED,
        }
    }

    /// Tells the user on stderr, with the chain of causes.
    pub fn print(&self) {
        match self {
            Self::Diagnostics { plain, styled } => {
                let text = if io::stderr().is_terminal() { styled } else { plain };
                say_as_it_is(text.trim_end());
            }
            Self::Interrupted { .. } => say(&self.to_string()),
            Self::Stdout(error) if error.kind() == io::ErrorKind::BrokenPipe => {}
            _ => {
                say(&format!("error: {self}"));
                let mut cause = self.source();
                while let Some(error) = cause {
                    say(&format!("  because: {}", harmless(&error.to_string())));
                    cause = error.source();
                }
            }
        }
    }
}
