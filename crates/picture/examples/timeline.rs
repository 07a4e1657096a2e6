//! Draws a plan of three steps as an SVG picture and as text for a terminal.
//!
//! `cargo run -p metaplan-picture --example timeline -- plan.svg`
#![expect(clippy::print_stdout, reason = "an example prints")]

use std::error::Error;

use metaplan_picture::{Plan, Step};

fn main() -> Result<(), Box<dyn Error>> {
    let step = |label: &str, (start, end): (f64, f64), design: &str| Step {
        label: label.to_owned(),
        start,
        end,
        configuration: vec![("localize".to_owned(), design.to_owned())],
        ..Step::default()
    };
    let plan = Plan {
        verdict: "cost 34, optimal, proved".to_owned(),
        steps: vec![
            step("go hall aisle", (0.0, 12.0), "camera"),
            step("go aisle shelf", (12.0, 30.0), "lidar"),
            step("pick box", (30.0, 34.0), "lidar"),
        ],
        ..Plan::default()
    };
    match plan.text(80) {
        Some(text) => println!("{text}"),
        None => println!("80 columns are too few"),
    }
    if let Some(file) = std::env::args().skip(1).find(|word| !word.starts_with('-')) {
        std::fs::write(file, plan.svg())?;
    }
    Ok(())
}
