//! The whole command line, also for binaries that add laws of their own: `gearlash::cli::main()`.

mod check;
mod compare;
mod digits;
mod elements;
mod export;
mod kinematics;
mod merge;
mod new;
mod numbers;
mod plot;
mod progress;
mod run;
mod signals;

use crate::element::table_mistakes;
use crate::error::{Colour, Error, render};
use crate::output::FigureFormat;
use crate::output::export::ExportFormat;
use crate::report::shown;
use crate::study::Shard;
use clap::{CommandFactory, Parser, Subcommand};
use std::io::{IsTerminal, Write};
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

/// Nonlinear dynamics of gear trains with clearances.
#[derive(Debug, Parser)]
#[command(name = "gearlash", version, about, long_about = None, arg_required_else_help = true)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Run the analyses of a model file and write tables, figures and a report.
    Run(RunArguments),
    /// Parse and validate a model file; print the coupled and scaled system.
    Check(CheckArguments),
    /// List all laws with parameters, units and defaults.
    Elements {
        /// Print JSON.
        #[arg(long)]
        json: bool,
    },
    /// Redraw the figures of a results folder from its tables, without a run.
    Plot(PlotArguments),
    /// Compare two results folders: differences of model and results, superimposed curves.
    Compare(CompareArguments),
    /// Export the tables of a results folder to MATLAB, Parquet, NumPy or netCDF.
    Export(ExportArguments),
    /// Merge the parts of a sharded study into the results of a single run.
    Merge(MergeArguments),
    /// Print the JSON schema of the model file, for completion and validation in editors.
    Schema,
    /// Write a commented starter model.
    New {
        /// File to create; it must not exist [default: standard output].
        file: Option<PathBuf>,
    },
    /// Print a shell completion script.
    Completions {
        /// Shell.
        shell: clap_complete::Shell,
    },
}

#[derive(Debug, clap::Args)]
struct RunArguments {
    /// Model file.
    file: PathBuf,
    /// Run only this analysis (repeatable).
    #[arg(long, value_name = "NAME")]
    only: Vec<String>,
    /// Replace a value of the model, such as connections.mesh_1.element.half_gap="5 um" (repeatable).
    #[arg(long, value_name = "PATH=VALUE")]
    set: Vec<String>,
    /// Results folder [default: results/<file stem>].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    #[command(flatten)]
    figures: Figures,
    /// Compute only part I of N of every parameter study (I from 1), for job arrays; see `gearlash merge`.
    #[arg(long, value_name = "I/N")]
    shard: Option<Shard>,
    /// Number of threads [default: number of processors].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    jobs: Option<u16>,
    /// End the run after this time, such as 90s, 10min or 2h, and write partial results.
    #[arg(long, value_name = "TIME", value_parser = time)]
    time_limit: Option<Duration>,
    /// Memory limit, such as 500MB or 4GB: analyses with a larger estimate are rejected, and the run ends when it
    /// exceeds the limit.
    #[arg(long, value_name = "SIZE", value_parser = size)]
    memory_limit: Option<u64>,
    /// Print warnings and errors only.
    #[arg(long)]
    quiet: bool,
}

#[derive(Debug, clap::Args)]
struct PlotArguments {
    /// Results folder written by `gearlash run`.
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// Run only this analysis (repeatable).
    #[arg(long, value_name = "NAME")]
    only: Vec<String>,
    /// Override a key of `plot:` in the model file, such as x_unit=rpm, y=rms,impacts, y_scale=log, backbone=true,
    /// size=one_column (repeatable).
    #[arg(long, value_name = "KEY=VALUE")]
    plot: Vec<String>,
    #[command(flatten)]
    figures: Figures,
    /// Print errors only.
    #[arg(long)]
    quiet: bool,
}

#[derive(Debug, clap::Args)]
struct CompareArguments {
    /// Results folder of the first run.
    #[arg(value_name = "DIR_A")]
    first: PathBuf,
    /// Results folder of the second run.
    #[arg(value_name = "DIR_B")]
    second: PathBuf,
    /// Output folder [default: results/<DIR_A>-and-<DIR_B>].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    #[command(flatten)]
    figures: Figures,
}

#[derive(Debug, clap::Args)]
struct ExportArguments {
    /// Results folder written by `gearlash run`.
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// mat (MATLAB), parquet, npz (NumPy) or netcdf.
    #[arg(long, value_name = "FORMAT", value_parser = export::format)]
    format: ExportFormat,
    /// Run only this analysis (repeatable).
    #[arg(long, value_name = "NAME")]
    only: Vec<String>,
    /// Write column names as rms_mesh_1 instead of rms.mesh_1 (always in .mat).
    #[arg(long)]
    safe_names: bool,
    /// Output folder [default: DIR].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

#[derive(Debug, clap::Args)]
struct MergeArguments {
    /// Folders of the parts written by `gearlash run --shard I/N`.
    #[arg(required = true, value_name = "DIR")]
    parts: Vec<PathBuf>,
    /// Results folder.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    #[command(flatten)]
    figures: Figures,
    /// Print warnings and errors only.
    #[arg(long)]
    quiet: bool,
}

#[derive(Debug, clap::Args)]
struct CheckArguments {
    /// Model file.
    file: PathBuf,
    /// Replace a value of the model (repeatable).
    #[arg(long, value_name = "PATH=VALUE")]
    set: Vec<String>,
    /// List all numbers of the model with name, value, unit and range instead of the system.
    #[arg(long)]
    numbers: bool,
    /// Print JSON.
    #[arg(long)]
    json: bool,
    /// Also draw the train: .svg, .png or .pdf [default: <file stem>.svg].
    #[arg(long, value_name = "PATH", num_args = 0..=1, require_equals = true)]
    figure: Option<Option<PathBuf>>,
}

/// Exit status: some analysis ended early.
const ENDED_EARLY: u8 = 1;
/// Exit status: bad input, or a file that cannot be read or written.
const BAD_INPUT: u8 = 2;

/// Runs the program on the arguments of the process.
pub fn main() -> ExitCode {
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(error) => {
            let status = if error.use_stderr() {
                ExitCode::from(BAD_INPUT)
            } else {
                ExitCode::SUCCESS
            };
            // A closed pipe is the reader's business.
            let _ = error.print();
            return status;
        }
    };
    let mistakes = table_mistakes();
    if !mistakes.is_empty() {
        mistakes.iter().for_each(|m| say(&format!("error: {m}")));
        return ExitCode::from(BAD_INPUT);
    }
    let result = match arguments.command {
        Command::Run(arguments) => run::run(&arguments),
        Command::Plot(arguments) => plot::plot(&arguments),
        Command::Compare(arguments) => compare::compare(&arguments),
        Command::Export(arguments) => export::export(&arguments),
        Command::Merge(arguments) => merge::merge(&arguments),
        Command::Check(arguments) => check::check(&arguments).map(|()| ExitCode::SUCCESS),
        Command::Elements { json } => print(&elements::list(json)),
        Command::Schema => print(&format!("{:#}\n", crate::schema::schema())),
        Command::New { file } => new::new(file.as_deref()),
        Command::Completions { shell } => {
            let mut text = Vec::new();
            clap_complete::generate(shell, &mut Arguments::command(), "gearlash", &mut text);
            print(&String::from_utf8_lossy(&text))
        }
    };
    result.unwrap_or_else(|error| {
        complain(&describe(&error));
        ExitCode::from(BAD_INPUT)
    })
}

/// A number before a unit, the number and the unit.
fn number(text: &str) -> Option<(f64, &str)> {
    let text = text.trim();
    let end = text
        .find(|c: char| c.is_ascii_alphabetic())
        .unwrap_or(text.len());
    let value: f64 = text[..end].trim().parse().ok()?;
    (value > 0.0 && value.is_finite()).then_some((value, text[end..].trim()))
}

/// A value of `--time-limit`.
fn time(text: &str) -> Result<Duration, String> {
    let units = [
        ("", 1.0),
        ("s", 1.0),
        ("min", 60.0),
        ("h", 3600.0),
        ("d", 86_400.0),
    ];
    let scaled = number(text).and_then(|(value, unit)| {
        let (_, length) = units.into_iter().find(|(name, _)| *name == unit)?;
        Duration::try_from_secs_f64(value * length).ok()
    });
    scaled.ok_or_else(|| "wanted a number > 0 with s, min, h or d, such as 90s".into())
}

/// A value of `--memory-limit`.
fn size(text: &str) -> Result<u64, String> {
    let scaled = number(text).and_then(|(value, unit)| {
        let unit = unit.to_ascii_lowercase();
        let (prefix, base) = match unit.strip_suffix("ib") {
            Some(prefix) => (prefix, 1024.0_f64),
            None => (unit.strip_suffix('b').unwrap_or(&unit), 1000.0),
        };
        let power = ["", "k", "m", "g", "t"]
            .into_iter()
            .position(|p| p == prefix)?;
        let bytes = value * base.powi(i32::try_from(power).ok()?);
        (bytes < 1e18).then_some(bytes as u64)
    });
    scaled.ok_or_else(|| "wanted a number > 0 with MB, GB, MiB or GiB, such as 4GB".into())
}

/// The formats of figures, for every command that draws.
#[derive(Debug, clap::Args)]
struct Figures {
    /// Figure formats.
    #[arg(long, value_delimiter = ',', value_parser = figure_format)]
    #[cfg_attr(feature = "figures", arg(default_value = "svg"))]
    figures: Vec<FigureFormat>,
}

impl Figures {
    /// Formats without immediate repetitions.
    fn formats(&self) -> Vec<FigureFormat> {
        let mut list = self.figures.clone();
        list.dedup();
        list
    }
}

/// A word of `--figures`.
fn figure_format(word: &str) -> Result<FigureFormat, String> {
    let known = FigureFormat::ALL;
    let found = known.iter().find(|f| f.extension() == word);
    found.copied().ok_or_else(|| match known {
        [] => "this program was built without the feature `figures`".into(),
        _ => {
            let list: Vec<&str> = known.iter().map(|f| f.extension()).collect();
            format!("wanted one of {}", list.join(", "))
        }
    })
}

/// An error as text for the terminal, with the places in the model file.
fn describe(error: &Error) -> String {
    match error {
        Error::Input(list) => {
            let colour = if std::io::stderr().is_terminal() {
                Colour::Ansi
            } else {
                Colour::Plain
            };
            render(list, colour)
        }
        other => format!("error: {}", shown(&other.to_string())),
    }
}

/// A line for standard error. Texts of a model file cannot move the cursor or change colours.
fn say(text: &str) {
    complain(&shown(text));
}

/// A text for standard error. A reader that has gone is no reason to lose results.
fn complain(text: &str) {
    let _ = writeln!(std::io::stderr().lock(), "{text}");
}

/// Prints to standard output; a reader that closes the pipe early is not an error.
fn print(text: &str) -> Result<ExitCode, Error> {
    let mut out = std::io::stdout().lock();
    match out
        .write_all(shown(text).as_bytes())
        .and_then(|()| out.flush())
    {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => Err(Error::File {
            action: "write",
            path: "standard output".into(),
            source: error,
        }),
        _ => Ok(ExitCode::SUCCESS),
    }
}
