//! `metaplan plan --svg` and `--picture`: the plan as a timeline, in a file and in the terminal.

use std::io::IsTerminal as _;
use std::path::PathBuf;

use clap::{Args, ValueEnum};
use console::Term;
use encodings::Solution;
use metaplan::mission::Mission;
use metaplan::report::timeline_picture;
use metaplan::visible::visible;

use crate::cli::common::Failure;
use crate::cli::output;

/// So wide is a picture where nobody says how wide the terminal is.
const COLUMNS: u16 = 100;

/// Where a plan is drawn.
#[derive(Debug, Args)]
pub(super) struct Drawing {
    /// Write the plan as a timeline into an SVG file, too.
    #[arg(long, value_name = "FILE", conflicts_with = "pareto")]
    svg: Option<PathBuf>,
    /// Whether text shows the plan as a timeline above the table of its steps.
    #[arg(long, value_enum, default_value_t)]
    picture: When,
}

#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, ValueEnum)]
enum When {
    /// Where the answer goes to a terminal that is wide enough.
    #[default]
    Auto,
    /// Wherever there is room for it; in 100 columns if the answer goes to no terminal.
    Always,
    /// No.
    Never,
}

impl Drawing {
    /// Writes the file, and returns the picture for a terminal: nothing where it is not wanted, or where there is too little room.
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
        let columns = Term::stdout().size_checked().map_or(COLUMNS, |(_, columns)| columns);
        let text = is_wanted.then(|| plan.text(usize::from(columns))).flatten();
        Ok(text.map(|text| text + "\n").unwrap_or_default())
    }
}
