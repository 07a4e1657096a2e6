//! Computes optimal values of a small Markov decision process (greatest probability, least and greatest expected
//! energy), with proved bounds.
//!
//! `cargo run -p metaplan-probabilistic --example gamble`
#![expect(clippy::print_stdout, reason = "an example prints")]

use std::error::Error;

use metaplan_probabilistic::check::{Answer, Options, Outcome, check};
use metaplan_probabilistic::{prism, property};

const MODEL: &str = r#"mdp
module robot
  s : [0..2] init 0;
  [dark]  s=0 -> 3/4 : (s'=1) + 1/4 : (s'=2);
  [light] s=0 -> (s'=1);
  [fetch] s=2 -> (s'=0);
endmodule
rewards "energy"
  [dark] true : 2;
  [light] true : 6;
  [fetch] true : 3;
endrewards
label "there" = s=1;
"#;

fn main() -> Result<(), Box<dyn Error>> {
    let model = prism::parse(MODEL)?;
    for text in
        [r#"Pmax=? [ F "there" ]"#, r#"R{"energy"}min=? [ F "there" ]"#, r#"R{"energy"}max=? [ F "there" ]"#]
    {
        let report = check(&model, &property::parse(text)?, &Options::default())?;
        match report.outcome {
            Outcome::Value(Answer::Finite(found)) => {
                println!("{text}: {} (in [{}, {}])", found.value, found.lower, found.upper);
            }
            other => println!("{text}: {other:?}"),
        }
    }
    Ok(())
}
