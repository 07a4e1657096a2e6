//! The command `metaplan import`, which creates a mission from the files of another tool.

use std::path::PathBuf;

use crate::answers::ImportAnswer;
use crate::comparison::{MapOptions, import_map};
use crate::file::source;
use crate::message::Message;
use clap::{Args, Subcommand, ValueEnum};

use crate::cli::common::{Common, Exit, Failure, Format};
use crate::cli::output;

/// Arguments of `import`.
#[derive(Debug, Args)]
pub struct Arguments {
    #[command(subcommand)]
    what: Form,
}

#[derive(Debug, Subcommand)]
enum Form {
    /// Import a map of Cámara et al. as a mission: `map-p2cp3.json`, another map in this format, or a map of
    /// 2017. Moves can fail or collide with the probabilities in the map; maps of 2017 have none.
    CamaraMap(CamaraMap),
}

#[derive(Debug, Args)]
struct CamaraMap {
    /// The map file.
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// Name of the initial place in the map.
    #[arg(long, default_value = "l1")]
    start: String,
    /// Name of the goal place in the map.
    #[arg(long, default_value = "l18")]
    goal: String,
    /// Initial configuration.
    #[arg(long, default_value = "amcl-lidar")]
    configuration: String,
    /// Neighbouring places with a dark way between them; the map does not contain this (repeatable, or
    /// separated by commas).
    #[arg(long, value_name = "A-B", value_delimiter = ',', value_parser = two)]
    dark: Vec<(String, String)>,
    /// Initial battery, in the energy unit of the arcs.
    #[arg(long, value_name = "UNITS", default_value_t = 32_560, conflicts_with = "no_battery")]
    battery: u32,
    /// Create a mission without a battery.
    #[arg(long)]
    no_battery: bool,
    /// Speeds at which each localisation method is a configuration.
    #[arg(long, value_enum, default_value_t = Speeds::All)]
    speeds: Speeds,
    /// Time to enable or disable one component, in seconds.
    #[arg(long, value_name = "SECONDS", default_value_t = 5)]
    switch: u32,
    /// Probabilities to import.
    #[arg(long, value_enum, default_value_t = Uncertainty::All)]
    risk: Uncertainty,
    /// The mission's name.
    #[arg(long, default_value = "camara")]
    name: String,
    /// Directory for the mission's files; created if it does not exist. Existing files with another content are not
    /// overwritten.
    #[arg(long, short, value_name = "DIR")]
    output: PathBuf,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Uncertainty {
    /// No probabilities.
    None,
    /// Probabilities of collisions.
    Collisions,
    /// Probabilities of collisions and of incomplete moves.
    All,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Speeds {
    /// Full speed only, for which the map has measurements: 6 configurations.
    Full,
    /// Full, half and safe speed, as in the original: 18 configurations. Times are inversely
    /// proportional to the speed; there are no collisions at safe speed.
    All,
}

fn two(text: &str) -> Result<(String, String), String> {
    let pair = text.split_once('-').ok_or_else(|| format!("`{text}` is not of the form A-B"))?;
    Ok((pair.0.trim().to_owned(), pair.1.trim().to_owned()))
}

pub fn run(arguments: &Arguments, common: &Common) -> Result<Exit, Failure> {
    let Form::CamaraMap(map) = &arguments.what;
    let is_name = map.name.starts_with(|c: char| c.is_ascii_alphabetic())
        && map.name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
    if !is_name {
        let text = format!(
            "`{}` cannot name a mission; use letters, digits and `_`, and begin with a letter",
            map.name
        );
        return Err(Failure::usage(Message::error("M107", text)));
    }
    let file = source(&map.file)?;
    let options = MapOptions {
        name: map.name.clone(),
        start: map.start.clone(),
        goal: map.goal.clone(),
        configuration: map.configuration.clone(),
        dark: map.dark.clone(),
        battery: (!map.no_battery).then_some(map.battery),
        switch_seconds: map.switch,
        collisions: map.risk != Uncertainty::None,
        failures: map.risk == Uncertainty::All,
        speeds: map.speeds == Speeds::All,
    };
    let files = import_map(file.name(), file.text(), &options)?;
    output::warnings(common, &files.warnings);
    output::require_directory(&map.output)?;
    let manifest = map.output.join(format!("{}.toml", map.name));
    let written = [
        (manifest.clone(), &*files.manifest),
        (map.output.join(format!("{}.ttl", map.name)), &files.knowledge),
        (map.output.join("domain.pddl"), &files.domain),
        (map.output.join("problem.pddl"), &files.problem),
        (map.output.join("positions.csv"), &files.positions),
    ];
    output::require_unchanged(written.clone())?;
    output::make_directory(&map.output)?;
    for (path, text) in &written {
        output::write_file(path, text)?;
    }
    let manifest = manifest.display().to_string();
    match common.format {
        Format::Json => output::json_answer(&ImportAnswer::new(manifest)),
        _ => output::answer(&format!("{manifest}\n")),
    }
    Ok(Exit::Done)
}
