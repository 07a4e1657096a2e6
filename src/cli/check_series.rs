//! Series of values of model constants for `metaplan check`, and tables of the results.

use crate::message::Message;
use num_bigint::BigInt;
use num_traits::{Signed, Zero as _};
use probabilistic::Error;
use probabilistic::check::{Answer, Outcome, Report};
use probabilistic::number::parse_decimal;
use probabilistic::prism::Settings;

use crate::cli::check_text::{number, shown};
use crate::cli::common::Failure;
use crate::cli::output;

/// Maximum number of values in a series, and of combinations of the values of all constants.
const MOST: usize = 100_000;

pub struct Combination {
    pub settings: Settings,
    /// The constants for which a series is given, with their values, in the order of the command
    /// line.
    pub varied: Vec<(String, String)>,
}

impl Combination {
    /// Adds the values of the constants with a series to the messages, because other values may have no error.
    pub fn named_in(&self, failure: Failure) -> Failure {
        if self.varied.is_empty() {
            return failure;
        }
        let values: Vec<_> = self.varied.iter().map(|(name, value)| format!("{name}={value}")).collect();
        let help = format!("this is the model with {}", values.join(", "));
        Failure { messages: failure.messages.map(|message| message.with_help(help.as_str())), ..failure }
    }
}

pub type Row<'a> = (&'a Combination, &'a [Result<Report, Error>]);

/// Returns all combinations of the values of the constants. The value of the last constant changes
/// fastest.
pub fn combinations(constants: &[(String, String)]) -> Result<Vec<Combination>, Failure> {
    let mut combinations = vec![Combination { settings: Settings::new(), varied: Vec::new() }];
    for (index, (name, text)) in constants.iter().enumerate() {
        if constants[..index].iter().any(|(earlier, _)| earlier == name) {
            let text = format!("the constant `{name}` has two values");
            return Err(Failure::usage(Message::error("M107", text)));
        }
        let values = values(name, text).map_err(|text| Failure::usage(Message::error("M107", text)))?;
        if combinations.len().saturating_mul(values.len()) > MOST {
            let text = format!("more than {MOST} combinations of the values of constants");
            return Err(Failure::usage(Message::error("M107", text)));
        }
        let mut next = Vec::new();
        for known in &combinations {
            for value in &values {
                let mut settings = known.settings.clone();
                settings.insert(name.clone(), value.clone());
                let mut varied = known.varied.clone();
                if values.len() > 1 {
                    varied.push((name.clone(), value.clone()));
                }
                next.push(Combination { settings, varied });
            }
        }
        combinations = next;
    }
    Ok(combinations)
}

/// Parses one value, or a series in PRISM's form `first:last` or `first:step:last`.
fn values(name: &str, text: &str) -> Result<Vec<String>, String> {
    let parts: Vec<&str> = text.split(':').map(str::trim).collect();
    let (first, step, last) = match parts[..] {
        [_] => return Ok(vec![text.to_owned()]),
        [first, last] => (first, "1", last),
        [first, step, last] => (first, step, last),
        _ => return Err(format!("`{name}={text}` is not a series; write `first:last` or `first:step:last`")),
    };
    let read = |part: &str| {
        let (negative, digits) = part.strip_prefix('-').map_or((false, part), |digits| (true, digits));
        let value = match digits.split_once('/') {
            Some((numerator, denominator)) => parse_decimal(denominator)
                .filter(|denominator| !denominator.is_zero())
                .and_then(|denominator| Some(parse_decimal(numerator)? / denominator)),
            None => parse_decimal(digits),
        };
        let value = value.ok_or_else(|| {
            format!("`{part}` of the series `{name}={text}` is not a number; write it like `0.25` or `1/4`")
        })?;
        Ok::<_, String>(if negative { -value } else { value })
    };
    let (first, step, last) = (read(first)?, read(step)?, read(last)?);
    if !step.is_positive() {
        return Err(format!("the step of the series `{name}={text}` must be positive"));
    }
    if &first + &step > last {
        return Err(format!(
            "the series `{name}={text}` has less than two values; a series is `first:step:last`, as PRISM writes it"
        ));
    }
    let count = ((&last - &first) / &step).to_integer();
    if count >= BigInt::from(MOST) {
        return Err(format!("the series `{name}={text}` has more than {MOST} values"));
    }
    let mut values = Vec::new();
    let mut value = first;
    while value <= last {
        values.push(pddl::to_decimal(&value).unwrap_or_else(|| value.to_string()));
        value += &step;
    }
    Ok(values)
}

fn cell(report: &Result<Report, Error>, text: impl Fn(&Answer) -> String) -> String {
    match report {
        Err(_) => "no answer".to_owned(),
        Ok(report) => match &report.outcome {
            Outcome::Value(answer) => text(answer),
            Outcome::Truth(holds, _) => holds.to_string(),
            Outcome::Undecided(_) => "not decided".to_owned(),
            Outcome::Range(least, greatest) => format!("{}..{}", text(least), text(greatest)),
            Outcome::Constrained { randomised, .. } => text(randomised),
            Outcome::Front(vertices) => {
                let pairs = vertices.iter().map(|pair| pair.each_ref().map(&text).join(" "));
                pairs.collect::<Vec<_>>().join("; ")
            }
            Outcome::States(states) => output::counted(states.len(), "state"),
        },
    }
}

pub fn table(heads: &[&str], rows: &[Row<'_>]) -> String {
    let header = header(heads, rows);
    let lines = rows.iter().map(|(combination, reports)| {
        let values = combination.varied.iter().map(|(_, value)| value.clone());
        values.chain(reports.iter().map(|report| cell(report, shown))).collect()
    });
    output::table(&header, lines)
}

fn header<'a>(heads: &[&'a str], rows: &[Row<'a>]) -> Vec<&'a str> {
    let varied = rows.first().map_or(&[][..], |(combination, _)| &combination.varied);
    varied.iter().map(|(name, _)| &name[..]).chain(heads.iter().copied()).collect()
}

/// Formats the results as CSV. Finite values are written as doubles.
pub fn csv(heads: &[&str], rows: &[Row<'_>]) -> String {
    let plain = |answer: &Answer| match answer {
        Answer::Finite(quantity) => number(quantity.value),
        other => shown(other),
    };
    let mut writer = csv::Writer::from_writer(Vec::new());
    let mut write = |fields: Vec<String>| writer.write_record(fields).expect("invariant: memory takes all");
    write(header(heads, rows).into_iter().map(str::to_owned).collect());
    for (combination, reports) in rows {
        let values = combination.varied.iter().map(|(_, value)| value.clone());
        write(values.chain(reports.iter().map(|report| cell(report, plain))).collect());
    }
    let bytes = writer.into_inner().expect("invariant: memory takes all");
    String::from_utf8(bytes).expect("invariant: made of text")
}
