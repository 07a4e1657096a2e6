//! Formats the results of `metaplan check` as text.

use std::fmt::Write as _;

use probabilistic::check::{Answer, Listed, Outcome, Report};

use crate::cli::output::{self, counted};

pub fn as_text(report: &Report, verbose: bool) -> String {
    let mut text = match &report.outcome {
        Outcome::Value(answer) => format!("{}\n", shown(answer)),
        Outcome::Truth(holds, answer) => {
            let value = answer.as_ref().map(|answer| format!(" ({})", shown(answer))).unwrap_or_default();
            format!("{holds}{value}\n")
        }
        Outcome::Undecided(answer) => format!("not decided: {}\n", shown(answer)),
        Outcome::Range(least, greatest) => format!("from {} to {}\n", shown(least), shown(greatest)),
        Outcome::States(states) => states_text(&report.variables, states),
        Outcome::Front(vertices) => {
            let rows = vertices.iter().map(|pair| pair.iter().map(shown).collect());
            output::table(&["first", "second"], rows)
        }
        Outcome::Constrained { randomised: Answer::Undefined, proved: true, .. } => {
            "undefined: no policy satisfies the bound (proved)\n".to_owned()
        }
        Outcome::Constrained { randomised, deterministic, proved } => {
            let note = match randomised {
                _ if *proved => "",
                Answer::Undefined => {
                    " (not proved in floating-point arithmetic; `--exact` proves it if its budget suffices)"
                }
                _ => " (perhaps not the best)",
            };
            format!("randomised: {}\ndeterministic: {}{note}\n", shown(randomised), shown(deterministic))
        }
    };
    if verbose {
        let Report { states, choices, transitions, deadlocks, build, solve, .. } = report;
        let _ = writeln!(
            text,
            "{}, {}, {}, {}; \
             built in {:.3} s, solved in {:.3} s",
            counted(*states, "state"),
            counted(*choices, "choice"),
            counted(*transitions, "transition"),
            counted(*deadlocks, "deadlock"),
            build.as_secs_f64(),
            solve.as_secs_f64()
        );
    }
    text
}

fn states_text(variables: &[(String, bool)], states: &[Listed]) -> String {
    if states.is_empty() {
        return "no state\n".to_owned();
    }
    let mut header: Vec<&str> = variables.iter().map(|(name, _)| &name[..]).collect();
    header.push("value");
    let rows = states.iter().map(|listed| {
        let values = variables.iter().zip(&listed.values).map(|((_, is_bool), value)| {
            if *is_bool { (*value != 0).to_string() } else { value.to_string() }
        });
        let value = listed.answer.as_ref().map(shown).or_else(|| listed.truth.map(|truth| truth.to_string()));
        values.chain([value.unwrap_or_default()]).collect()
    });
    output::table(&header, rows)
}

/// Formats a value with its accuracy, for example `3`, `0.5 (1/2)`, or `0.3 (between 0.299 and 0.301)`. Long
/// fractions are marked as `(exact, rounded)`.
pub fn shown(answer: &Answer) -> String {
    match answer {
        Answer::Infinite => "infinite".to_owned(),
        Answer::Undefined => "undefined: no policy within the bound was found".to_owned(),
        Answer::Finite(quantity) => match &quantity.exact {
            Some(exact) if exact.is_integer() => exact.to_string(),
            Some(exact) if exact.denom().bits() + exact.numer().bits() <= 128 => {
                format!("{} ({exact})", number(quantity.value))
            }
            Some(_) => format!("{} (exact, rounded)", number(quantity.value)),
            None if quantity.lower >= quantity.upper => number(quantity.value),
            None => {
                let [value, lower, upper] = [quantity.value, quantity.lower, quantity.upper].map(number);
                format!("{value} (between {lower} and {upper})")
            }
        },
    }
}

pub fn number(value: f64) -> String {
    let size = value.abs();
    if value != 0.0 && size < 1e-6 || size >= 1e21 { format!("{value:e}") } else { value.to_string() }
}
