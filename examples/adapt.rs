//! Example of the library: plans for a mission, verifies the certificate of the plan, and runs the adaptation loop when
//! a component fails.
//!
//! `cargo run --example adapt -- MANIFEST COMPONENT`; by default the ground vehicle and its Kinect.
#![expect(clippy::print_stdout, reason = "an example prints")]

use std::error::Error;
use std::path::Path;
use std::time::Duration;

use metaplan::certificate::Verifier;
use metaplan::mapek::{Loop, Observation};
use metaplan::planner::Planner;
use metaplan::setup::Setup;

fn main() -> Result<(), Box<dyn Error>> {
    let words: Vec<String> = std::env::args().skip(1).filter(|word| !word.starts_with('-')).collect();
    let own = concat!(env!("CARGO_MANIFEST_DIR"), "/missions/ugv.toml").to_owned();
    let manifest = words.first().unwrap_or(&own);
    let component = words.get(1).map_or("c_kinect", String::as_str);
    let setup = Setup::read(Path::new(manifest))?;

    // The certificate contains everything that is needed to check that the plan is optimal.
    let planned = Planner::new(&setup.mission)?.time_limit(Duration::from_secs(60)).plan()?;
    println!("{}", planned.solution.verdict());
    let directory = std::env::temp_dir().join(format!("metaplan-adapt-{}", std::process::id()));
    planned.certify(&directory)?;
    let verification = Verifier::new(&directory).mission(&setup.mission).verify();
    println!("the certificate is {}", if verification.verified() { "verified" } else { "wrong" });
    std::fs::remove_dir_all(&directory)?;

    // The loop receives reports of the robot, and returns requests for the robot.
    let mut control = Loop::new(setup.mission, setup.settings)?;
    for answer in control.start() {
        println!("{}", answer.to_json());
    }
    let event = format!(r#"{{"event": "component_status", "component": "{component}", "status": "FALSE"}}"#);
    for answer in control.handle(&Observation::parse(&event), Duration::from_secs(5)) {
        println!("{}", answer.to_json());
    }
    Ok(())
}
