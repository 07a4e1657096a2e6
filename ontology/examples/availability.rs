//! Counts the function designs of a knowledge base. For each component, lists the designs that are unavailable after
//! its failure.
//!
//! `cargo run -p metaplan-ontology --example availability -- KNOWLEDGE_BASE`
#![expect(clippy::print_stdout, reason = "an example prints")]

use std::error::Error;

use ontology::runtime::Runtime;
use ontology::tomasys::change::Status;

fn main() -> Result<(), Box<dyn Error>> {
    let default = concat!(env!("CARGO_MANIFEST_DIR"), "/kb/ugv.ttl");
    let file =
        std::env::args().nth(1).filter(|word| !word.starts_with('-')).unwrap_or_else(|| default.to_owned());
    let (runtime, warnings) = Runtime::builder().file(file).build()?;
    for warning in warnings {
        println!("{warning}");
    }
    let designs = runtime.view().function_designs();
    println!("{} designs", designs.len());
    for component in runtime.view().components() {
        // The copy shares the relations that do not change.
        let mut broken = runtime.clone();
        broken.report_component(&component.individual.name, Status::Failed)?;
        let lost = broken.view().function_designs();
        let lost: Vec<&str> = lost
            .iter()
            .filter(|design| !design.available)
            .map(|design| design.individual.name.as_str())
            .collect();
        println!("without {}: {}", component.individual.name, lost.join(", "));
    }
    Ok(())
}
