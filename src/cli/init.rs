//! The command `metaplan init`, which creates a directory with a small mission.

use std::io::ErrorKind;
use std::path::{Path, PathBuf, is_separator};

use crate::answers::InitAnswer;
use crate::message::Message;
use crate::schemas::schema;
use crate::templates::{MANIFEST, Template};
use clap::{Args, ValueEnum};

use crate::cli::common::{Common, Exit, Failure, Format};
use crate::cli::output;

/// Arguments of `init`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// The new directory. Its last component is the mission's name.
    #[arg(value_name = "NAME")]
    directory: PathBuf,
    /// Template of the mission.
    #[arg(long, value_enum, default_value_t, value_name = "TEMPLATE")]
    from: Start,
}

#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, ValueEnum)]
enum Start {
    /// One function with two designs, and one action.
    #[default]
    Blank,
    /// The ground vehicle of the Metaplan paper: six designs for one function.
    Ugv,
    /// A warehouse robot with an arm: two functions with three designs each, a battery, a charger, a dark aisle.
    Warehouse,
}

impl From<Start> for Template {
    fn from(start: Start) -> Self {
        match start {
            Start::Blank => Self::Blank,
            Start::Ugv => Self::Ugv,
            Start::Warehouse => Self::Warehouse,
        }
    }
}

pub fn run(arguments: &Arguments, common: &Common) -> Result<Exit, Failure> {
    let (directory, template) = (arguments.directory.as_path(), Template::from(arguments.from));
    let path = directory.display().to_string();
    let Some(name) = directory.file_name().and_then(|name| name.to_str()) else {
        let text = format!("`{path}` does not name a new directory; give a name, such as `my-robot`");
        return Err(Failure::usage(Message::error("M107", text)));
    };
    let schema = output::pretty(&schema("manifest"));
    template.write(directory, name, &schema).map_err(|error| refused(directory, &path, error.kind()))?;
    let files: Vec<&str> = template.files(name, &schema).into_iter().map(|(file, _)| file).collect();
    if common.format == Format::Json {
        output::json_answer(&InitAnswer::new(&path, template.name(), files));
    } else {
        let manifest = directory.join(MANIFEST);
        let next = format!("metaplan plan {}", shell_word(&manifest.display().to_string()));
        output::answer(&format!("{path}: {}\nnext: {next}\n", files.join(", ")));
    }
    Ok(Exit::Done)
}

/// Returns a path as an argument in the command line of a POSIX shell: in quotes if necessary, and without a leading `-`.
fn shell_word(path: &str) -> String {
    let path = if path.starts_with('-') { format!("./{path}") } else { path.to_owned() };
    let is_plain = |c: char| c.is_alphanumeric() || "_-.,:+@%=".contains(c) || is_separator(c);
    if path.chars().all(is_plain) { path } else { format!("'{}'", path.replace('\'', r"'\''")) }
}

fn refused(directory: &Path, shown: &str, error: ErrorKind) -> Message {
    let above = directory.parent().filter(|above| !above.as_os_str().is_empty());
    match (error, above) {
        (ErrorKind::AlreadyExists | ErrorKind::DirectoryNotEmpty, _) => {
            let text = "this exists already, and nothing is overwritten; choose another name";
            Message::at("M133", shown, None, text)
        }
        (ErrorKind::NotFound, Some(above)) => {
            let text =
                format!("the directory cannot be written: there is no directory `{}`", above.display());
            Message::at("M109", shown, None, text)
        }
        (error, _) => Message::at("M109", shown, None, format!("the directory cannot be written: {error}")),
    }
}
