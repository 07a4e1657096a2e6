//! Answers as pictures: `metaplan plan --svg` and `--picture`, and the pages and files of answers
//! with several pictures.

use std::io::IsTerminal as _;
use std::path::{Path, PathBuf};

use crate::mission::Mission;
use crate::report::timeline_picture;
use crate::visible::visible;
use clap::{Args, ValueEnum};
use picture::Sheet;
use planner::Solution;

use crate::cli::common::Failure;
use crate::cli::output;

const COLUMNS: u16 = 100;

/// Options for the picture of a plan.
#[derive(Debug, Args)]
pub(super) struct Drawing {
    /// Also write the plan as a timeline to an SVG file; with `--pareto`, the front.
    #[arg(long, value_name = "FILE")]
    svg: Option<PathBuf>,
    /// Show the plan as a timeline above the table of its steps.
    #[arg(long, value_enum, default_value_t)]
    picture: When,
}

#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, ValueEnum)]
enum When {
    /// If the answer goes to a terminal that is wide enough.
    #[default]
    Auto,
    /// If there is room for it; in 100 columns if the answer does not go to a terminal.
    Always,
    /// Never.
    Never,
}

/// Options for the page of an answer.
#[derive(Debug, Clone, Default, Args)]
pub(super) struct Pages {
    /// Also write the answer as an HTML page.
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
    /// Write each picture of the page as an SVG file to a directory; created if it does not exist.
    #[arg(long, value_name = "DIR")]
    svg: Option<PathBuf>,
}

impl Pages {
    pub(super) fn are_wanted(&self) -> bool {
        self.report.is_some() || self.svg.is_some()
    }

    pub(super) fn write(&self, sheet: &Sheet) -> Result<(), Failure> {
        if let Some(directory) = &self.svg {
            write_pictures(directory, &sheet.pictures())?;
        }
        match &self.report {
            Some(file) => output::write_file(file, &visible(&sheet.html())),
            None => Ok(()),
        }
    }
}

pub(super) fn write_pictures(directory: &Path, pictures: &[(String, String)]) -> Result<(), Failure> {
    output::make_directory(directory)?;
    pictures.iter().try_for_each(|(name, text)| output::write_file(&directory.join(name), &visible(text)))
}

impl Drawing {
    pub(super) fn is_file_wanted(&self) -> bool {
        self.svg.is_some()
    }

    pub(super) fn draw_front(&self, sheet: &Sheet) -> Result<(), Failure> {
        let (Some(file), [(_, picture)]) = (&self.svg, &sheet.pictures()[..]) else { return Ok(()) };
        output::write_file(file, &visible(picture))
    }

    /// Writes the timeline of a plan to an SVG file, if requested, and returns it as text for a
    /// terminal. The text is empty if it is not requested or cannot be drawn in the width of the
    /// terminal.
    pub(super) fn draw(
        &self,
        mission: &Mission,
        solution: &Solution,
        is_text: bool,
    ) -> Result<String, Failure> {
        let is_wanted = is_text
            && match self.picture {
                When::Auto => std::io::stdout().is_terminal(),
                When::Always => true,
                When::Never => false,
            };
        if solution.plan.is_none() || self.svg.is_none() && !is_wanted {
            return Ok(String::new());
        }
        let plan = timeline_picture(mission, solution);
        if let Some(file) = &self.svg {
            output::write_file(file, &visible(&plan.svg()))?;
        }
        let columns = output::columns().unwrap_or(COLUMNS);
        let text = is_wanted.then(|| plan.text(usize::from(columns))).flatten();
        Ok(text.map(|text| text + "\n").unwrap_or_default())
    }
}
