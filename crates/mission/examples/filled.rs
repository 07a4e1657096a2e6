//! Prints the facts and values that a knowledge base adds to a PDDL problem, before and after the
//! failure of a component.
//!
//! `cargo run -p metaplan-mission --example filled`
#![expect(clippy::print_stdout, reason = "an example prints")]

use std::error::Error;
use std::path::Path;

use metaplan_mission::file::source;
use metaplan_mission::knowledge::{COADAPTATION, Knowledge, Sources};
use metaplan_mission::{Bindings, Mission};

fn main() -> Result<(), Box<dyn Error>> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let mut sources = Sources::default();
    sources.documents.push(root.join("ontology/kb/ugv.ttl"));
    sources.rules.push(COADAPTATION.to_owned());
    let [domain, problem] =
        ["domain", "problem"].map(|name| source(&root.join(format!("encodings/ugv/{name}.pddl"))));
    let mut mission =
        Mission::new("ugv", Some(Knowledge::read(&sources)), Bindings::default(), domain, problem)?;

    for failed in [None, Some("c_kinect")] {
        if let Some(component) = failed {
            mission.fail(component)?;
            println!("; without {component}");
        }
        let (problem, warnings) = mission.filled()?;
        for warning in warnings {
            println!("; {}", warning.text().trim_end());
        }
        let text = pddl::print_problem(&problem);
        for line in text.lines().filter(|line| line.contains("fd_")) {
            println!("{}", line.trim());
        }
    }
    Ok(())
}
