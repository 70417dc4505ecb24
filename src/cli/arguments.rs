//! The words of the command line.

use super::frames::FrameList;
use clap::{Args, Parser, Subcommand, ValueEnum, value_parser};
use clap_complete::Shell;
use kinora::description::{ExrLayout, IntegratorChoice};
use std::path::PathBuf;

/// Renders animated scenes into image sequences by simulating light.
#[derive(Debug, Parser)]
#[command(
    name = "kinora",
    version,
    arg_required_else_help = true,
    after_help = "\
Examples:
  kinora check scenes/ball.ron                     is the scene right, and what will it cost?
  kinora render scenes/ball.ron                    all its frames, into out/ball/
  kinora render scenes/ball.ron -f 12 -s 16 --size 320x240
                                                   one small, quick frame to look at

`kinora render --help` explains every option.",
    after_long_help = "\
Examples:
  kinora check scenes/ball.ron                     is the scene right, and what will it cost?
  kinora render scenes/ball.ron                    all its frames, into out/ball/
  kinora render scenes/ball.ron -f 12 -s 16 --size 320x240
                                                   one small, quick frame to look at

Exit codes:
   0  done
   1  the scene or one of its files is wrong
   2  the command line is wrong
  70  internal error: a mistake in kinora
  74  a file could not be written
  75  interrupted; finished frames are kept, run the same command again to go on"
)]
pub struct Arguments {
    #[command(subcommand)]
    pub command: Command,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    Render(RenderArguments),
    Check(CheckArguments),
    Develop(DevelopArguments),
    Completions(CompletionsArguments),
    Man(ManArguments),
}

/// Render the frames of a scene to EXR and PNG files
///
/// Every frame becomes NAME.NNNN.exr (linear, with all layers that the scene asks for) and
/// NAME.NNNN.png (developed: exposure, tone curve, sRGB), where NAME is the name of the scene
/// file. manifest.json beside them records times, settings and warnings.
///
/// Frames that are there already, whole and rendered from the same scene with the same settings,
/// are kept. So after an interruption (Ctrl-C) the same command goes on where it stopped.
/// Another exposure or tone curve renders nothing: the PNG is developed again from the EXR.
#[derive(Debug, Args)]
#[command(
    verbatim_doc_comment,
    after_long_help = "\
Examples:
  kinora render scenes/ball.ron
  kinora render scenes/ball.ron --frames 0-99:10 --samples 16
  kinora render scenes/ball.ron --set render.tonemap=Agx --set entities.ball.velocity.linear=(2,0,0)
  kinora render scenes/ball.ron --threads 2 --progress json > progress.jsonl"
)]
pub struct RenderArguments {
    #[command(flatten)]
    pub scene: SceneArguments,

    /// Which frames: 5, 0-47, 0-99:3 (every third), or 9,10,15-20 [default: the scene's]
    ///
    /// They are rendered in the order given. Frames outside the scene's own range are allowed,
    /// and so are those before time 0: -5, -12--1.
    #[arg(
        short = 'f',
        long,
        verbatim_doc_comment,
        value_name = "LIST",
        allow_hyphen_values = true
    )]
    pub frames: Option<FrameList>,

    /// Folder for the files; made if missing [default: out/NAME, NAME as the scene file]
    #[arg(short = 'o', long, value_name = "DIR")]
    pub out: Option<PathBuf>,

    /// Render all frames again, even those that are there already
    #[arg(long)]
    pub fresh: bool,

    /// Threads that render [default: one per processor]
    ///
    /// The picture does not depend on it, not by a single bit.
    #[arg(short = 'j', long, value_name = "N", value_parser = value_parser!(u32).range(1..=4096))]
    pub threads: Option<u32>,

    /// How progress is shown
    #[arg(long, value_enum, value_name = "FORM", default_value_t = ProgressForm::Human)]
    pub progress: ProgressForm,
}

/// Check a scene without rendering: validate it, print what it contains and what it will cost
///
/// All mistakes that can be found in one run are shown with their place in the file.
#[derive(Debug, Args)]
#[command(verbatim_doc_comment)]
pub struct CheckArguments {
    #[command(flatten)]
    pub scene: SceneArguments,
}

/// Develop PNG files again from EXR files, with another exposure or tone curve
///
/// Nothing is rendered: each NAME.NNNN.exr becomes NAME.NNNN.png beside it. What --set does not
/// name stays as the PNG there was developed, or else at exposure 0 and tone curve Srgb.
#[derive(Debug, Args)]
#[command(
    verbatim_doc_comment,
    after_long_help = "\
Examples:
  kinora develop out/ball --set render.tonemap=Agx
  kinora develop out/ball/ball.0012.exr --set render.exposure=1.5 --out out/bright"
)]
pub struct DevelopArguments {
    /// EXR files, or folders of them
    #[arg(value_name = "PATH", required = true)]
    pub paths: Vec<PathBuf>,

    /// What to change: render.exposure (stops), render.tonemap (Srgb, Agx, Aces or Reinhard)
    #[arg(long = "set", value_name = "PATH=VALUE", value_parser = parse_override)]
    pub overrides: Vec<String>,

    /// Folder for the PNG files; made if missing [default: beside the EXR files]
    #[arg(short = 'o', long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

/// Print what lets a shell complete commands, options and their values
#[derive(Debug, Args)]
#[command(after_long_help = "\
Examples:
  source <(kinora completions bash)
  kinora completions zsh > ~/.zfunc/_kinora
  kinora completions fish > ~/.config/fish/completions/kinora.fish")]
pub struct CompletionsArguments {
    /// The shell
    pub shell: Shell,
}

/// Print the manual page of kinora, or of one of its commands
#[derive(Debug, Args)]
#[command(after_long_help = "\
Examples:
  kinora man | man -l -
  kinora man render > /usr/local/share/man/man1/kinora-render.1")]
pub struct ManArguments {
    /// The command [default: the program as a whole]
    #[arg(value_name = "COMMAND")]
    pub command: Option<String>,
}

/// The scene, and what the command line changes in it.
#[derive(Debug, Args)]
pub struct SceneArguments {
    /// The scene file, such as scenes/ball.ron, or - for the standard input
    #[arg(value_name = "SCENE")]
    pub path: PathBuf,

    /// Width and height of the picture in pixels, such as 640x480 [default: the scene's]
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    pub size: Option<(u32, u32)>,

    /// Render a part of the picture alone: left, top, width and height in pixels
    ///
    /// Its pixels are those of the whole picture, bit for bit. The EXR has the part as its data
    /// window, the PNG is as large as the part.
    #[arg(long, verbatim_doc_comment, value_name = "X,Y,W,H", value_parser = parse_region)]
    pub region: Option<[u32; 4]>,

    /// Layers of the EXR as parts, or as channels such as albedo.R [default: the scene's]
    #[arg(long, value_enum, ignore_case = true, value_name = "LAYOUT")]
    pub exr_layout: Option<LayoutName>,

    /// Samples per pixel; four times as many halve the noise [default: the scene's]
    #[arg(short = 's', long, value_name = "N", value_parser = value_parser!(u32).range(1..))]
    pub samples: Option<u32>,

    /// How light is simulated [default: the scene's]
    #[arg(long, value_enum, ignore_case = true, value_name = "NAME")]
    pub integrator: Option<IntegratorName>,

    /// Seed of all random decisions: another seed, another noise [default: the scene's]
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,

    /// The camera entity to look through, where a scene has several
    #[arg(long, value_name = "NAME")]
    pub camera: Option<String>,

    /// Change any value of the scene, such as `render.max_depth=8` (repeatable)
    ///
    /// The path names fields as the scene file does; the value is written as in the file:
    /// --set entities.ball.velocity.linear=(2,0,0)
    #[arg(long = "set", verbatim_doc_comment, value_name = "PATH=VALUE", value_parser = parse_override)]
    pub overrides: Vec<String>,

    /// Folder in which the scene's meshes and textures are looked for as well (repeatable)
    ///
    /// Always searched: the scene's folder, and assets/ in it and beside it.
    #[arg(long = "assets", value_name = "DIR")]
    pub assets: Vec<PathBuf>,

    /// Let the scene read files outside its own folder and the asset folders
    #[arg(long)]
    pub allow_outside: bool,
}

/// How a running render tells about itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ProgressForm {
    /// Bars on a terminal, one line per frame otherwise (on stderr)
    Human,
    /// One JSON object per line (on stdout)
    Json,
    /// Nothing but errors
    None,
}

/// [`IntegratorChoice`] as a word.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum IntegratorName {
    /// Picks by what the scene requires, and says why
    Auto,
    /// Path tracing
    Path,
    /// Photon mapping: photons first, then the picture
    #[value(name = "photonmap", alias = "photon-map")]
    PhotonMap,
    /// Stochastic progressive photon mapping
    Sppm,
}

impl From<IntegratorName> for IntegratorChoice {
    fn from(name: IntegratorName) -> Self {
        match name {
            IntegratorName::Auto => Self::Auto,
            IntegratorName::Path => Self::Path,
            IntegratorName::PhotonMap => Self::PhotonMap,
            IntegratorName::Sppm => Self::Sppm,
        }
    }
}

/// [`ExrLayout`] as a word.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum LayoutName {
    /// One part for each layer
    Parts,
    /// One part for all
    Single,
}

impl From<LayoutName> for ExrLayout {
    fn from(name: LayoutName) -> Self {
        match name {
            LayoutName::Parts => Self::Parts,
            LayoutName::Single => Self::Single,
        }
    }
}

fn parse_size(text: &str) -> Result<(u32, u32), String> {
    let sides = text.split_once(['x', 'X', '×']);
    let side = |text: &str| text.trim().parse::<u32>().ok().filter(|&pixels| pixels > 0);
    sides
        .and_then(|(width, height)| Some((side(width)?, side(height)?)))
        .ok_or_else(|| "expected width and height in pixels, such as 640x480".to_owned())
}

fn parse_region(text: &str) -> Result<[u32; 4], String> {
    let numbers: Vec<u32> = text.split(',').filter_map(|n| n.trim().parse().ok()).collect();
    let region = <[u32; 4]>::try_from(numbers).ok().filter(|_| text.split(',').count() == 4);
    region.filter(|region| region[2] > 0 && region[3] > 0).ok_or_else(|| {
        "expected left, top, width and height in pixels, such as 100,50,64,64".to_owned()
    })
}

fn parse_override(text: &str) -> Result<String, String> {
    match text.split_once('=') {
        Some((path, value)) if !path.trim().is_empty() && !value.trim().is_empty() => {
            Ok(text.to_owned())
        }
        _ => Err("expected PATH=VALUE, such as render.max_depth=8".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_definition_of_the_command_line_is_consistent() {
        Arguments::command().debug_assert();
    }

    #[test]
    fn sizes_are_two_positive_numbers() {
        assert_eq!(parse_size("640x480"), Ok((640, 480)));
        assert_eq!(parse_size("1X1"), Ok((1, 1)));
        for wrong in ["", "640", "0x480", "640x0", "-1x5", "640x480x3", "axb", "99999999999x1"] {
            assert!(parse_size(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn regions_are_four_numbers_of_which_the_sides_are_positive() {
        assert_eq!(parse_region("0, 5,64,48"), Ok([0, 5, 64, 48]));
        for wrong in ["", "1,2,3", "1,2,3,4,5", "1,2,0,4", "1,2,3,0", "-1,2,3,4", "a,2,3,4"] {
            assert!(parse_region(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn overrides_need_a_path_and_a_value() {
        assert!(parse_override("a.b=(1, 2, 3)").is_ok());
        for wrong in ["", "a", "=1", "a="] {
            assert!(parse_override(wrong).is_err(), "{wrong}");
        }
    }

    /// Terminals of 100 columns show the help without broken lines.
    #[test]
    fn help_fits_in_a_hundred_columns() {
        for name in ["render", "check", "develop", "completions", "man"] {
            let mut command = Arguments::command();
            let text =
                command.find_subcommand_mut(name).expect("exists").render_long_help().to_string();
            for line in text.lines() {
                assert!(line.chars().count() <= 100, "{name}: {line}");
            }
        }
    }
}
