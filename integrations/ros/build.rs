//! Generates Rust types from the ROS definitions below `interfaces/`, with their type hashes. Also embeds the texts
//! of the definitions, in which the types that settings name are looked up at run time.

#[path = "build/definition.rs"]
mod definition;
#[path = "build/rust.rs"]
mod rust;
#[allow(dead_code, unreachable_pub, reason = "the package uses the rest")]
#[path = "src/types"]
mod types {
    pub mod definition;
    pub mod description;
}

use std::error::Error;
use std::path::{Path, PathBuf};

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-changed=interfaces");
    println!("cargo::rerun-if-changed=build");
    println!("cargo::rerun-if-changed=src/types/definition.rs");
    println!("cargo::rerun-if-changed=src/types/description.rs");
    let definitions = definition::read(Path::new("interfaces"))?;
    let texts = rust::texts(&definitions);
    let interfaces: Vec<_> = definitions.into_iter().map(|(interface, _)| interface).collect();
    let hashes = rust::hashes(&interfaces)?;
    let out = PathBuf::from(std::env::var("OUT_DIR")?);
    std::fs::write(out.join("definitions.rs"), texts)?;
    std::fs::write(out.join("interfaces.rs"), rust::modules(&interfaces, &hashes)?)?;
    std::fs::write(out.join("table.rs"), rust::table(&interfaces, &hashes))?;
    Ok(())
}
