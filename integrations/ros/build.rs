//! Generates Rust types from the ROS definitions below `interfaces/`, with their type hashes.

#[path = "build/definition.rs"]
mod definition;
#[path = "build/description.rs"]
mod description;
#[path = "build/rust.rs"]
mod rust;

use std::error::Error;
use std::path::{Path, PathBuf};

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-changed=interfaces");
    println!("cargo::rerun-if-changed=build");
    let interfaces = definition::read(Path::new("interfaces"))?;
    let hashes = description::hashes(&interfaces)?;
    let out = PathBuf::from(std::env::var("OUT_DIR")?);
    let modules = rust::modules(&interfaces, &hashes)?;
    std::fs::write(out.join("interfaces.rs"), modules + &rust::dispatch(&interfaces))?;
    std::fs::write(out.join("table.rs"), rust::table(&interfaces, &hashes))?;
    Ok(())
}
