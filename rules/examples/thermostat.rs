//! Example: the heating of a room follows temperature measurements. Prints after each measurement whether it is on.
//!
//! `cargo run -p metaplan-rules --example thermostat`
#![expect(clippy::print_stdout, reason = "an example prints")]

use std::error::Error;

use metaplan_rules::{Delta, Engine, Fact, Literal};

const RULES: &str = r"
    @prefix : <http://example.org/#> .
    [cold]   Room(?r) ^ temperature(?r, ?t) ^ swrlb:lessThan(?t, 18) -> Cold(?r) .
    [heat]   Cold(?r) ^ not windowOpen(?r, true) -> heated(?r, true) .
    [rooms]  -> Room(kitchen) ^ Room(study) .
";

fn main() -> Result<(), Box<dyn Error>> {
    let mut engine = Engine::builder().rules("thermostat.swrl", RULES).build()?;
    let mut name = |local: &str| engine.name(&format!("http://example.org/#{local}"));
    let [temperature, open, heated] = ["temperature", "windowOpen", "heated"].map(&mut name);
    let rooms = ["kitchen", "study"].map(&mut name);
    let yes = engine.literal(true.into());

    let mut measured: Option<Fact> = None;
    for (degrees, window) in [(21, false), (16, false), (16, true)] {
        let value = engine.literal(Literal::from(degrees));
        let fact = Fact::new(temperature, [rooms[0], value]);
        let delete: Vec<Fact> = measured.replace(fact.clone()).into_iter().collect();
        let mut insert = vec![fact];
        if window {
            insert.push(Fact::new(open, [rooms[0], yes]));
        }
        let change = engine.apply(Delta { insert, delete })?;
        println!("{degrees} degrees, window {}: {} facts change", if window { "open" } else { "closed" }, {
            change.insert.len() + change.delete.len()
        });
        let is_heated = Fact::new(heated, [rooms[0], yes]);
        match engine.why(&is_heated) {
            Some(derivation) => println!("  heated, in {} steps", derivation.steps.len()),
            None => println!("  not heated"),
        }
    }
    Ok(())
}
