//! The command `metaplan check`, which checks properties of a PRISM model.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use crate::answers::{CheckAnswer, ChecksAnswer};
use crate::file::source;
use crate::message::Message;
use clap::Args;
use probabilistic::check::{Answer, Exactness, Options, Outcome, PolicyTable, Precision, Report, check_all};
use probabilistic::explore::Bounds;
use probabilistic::prism::ast::Model;
use probabilistic::property::{Declarations, Listed};
use probabilistic::{Error, prism, property};

use crate::cli::check_series::{Combination, combinations, csv, table};
use crate::cli::check_text::as_text;
use crate::cli::common::{Common, Exit, Failure, Format, process_failure};
use crate::cli::limits::TimeLimit;
use crate::cli::output;
use crate::cli::progress::Progress;
use crate::cli::values::setting;

/// Arguments of `check`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// A model in the PRISM language.
    #[arg(value_name = "MODEL")]
    model: PathBuf,
    /// A property: `Pmax=? [ F "goal" ]`, `R{"time"}min=? [ F "goal" ]`, `multi(…, …)`.
    #[arg(value_name = "PROPERTY", required_unless_present = "props", conflicts_with = "props")]
    property: Option<String>,
    /// Check all properties of a file, which may also define constants and labels.
    #[arg(long, value_name = "FILE")]
    props: Option<PathBuf>,
    /// Check only the property with this name or number, from 1 (repeatable).
    #[arg(long, value_name = "NAME", requires = "props")]
    prop: Vec<String>,
    /// Value of a constant (repeatable, or separated by commas). A series `first:last` or
    /// `first:step:last` yields a table.
    #[arg(long = "const", value_name = "NAME=VALUE", value_delimiter = ',', value_parser = setting)]
    constants: Vec<(String, String)>,
    /// Also write the values to a CSV file.
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Write an optimal policy to a file.
    #[arg(long, value_name = "FILE", conflicts_with = "props")]
    policy: Option<PathBuf>,
    /// Evaluate the policy of a file instead of an optimal one.
    #[arg(long, value_name = "FILE", conflicts_with = "policy")]
    evaluate: Option<PathBuf>,
    /// Reward that breaks ties between optimal policies; it is minimised. Default: the number of steps.
    #[arg(long, value_name = "REWARD")]
    secondary: Option<String>,
    /// Stop if there are more than this many states.
    #[arg(long, value_name = "N", default_value_t = 20_000_000)]
    state_limit: usize,
    /// Always solve in rational numbers, even if this is slow.
    #[arg(long, conflicts_with = "inexact")]
    exact: bool,
    /// Always solve in doubles with certified bounds, even if the model is small.
    #[arg(long)]
    inexact: bool,
    #[command(flatten)]
    tightness: Tightness,
    #[command(flatten)]
    time: TimeLimit,
}

/// Options for the accuracy of values.
#[derive(Debug, Args)]
struct Tightness {
    /// Maximum distance between the bounds on a value, relative to the value unless `--absolute` is given.
    #[arg(long, value_name = "WIDTH", value_parser = width)]
    precision: Option<f64>,
    /// The precision is relative to the value (default).
    #[arg(long, requires = "precision", conflicts_with = "absolute")]
    relative: bool,
    /// The precision is an absolute difference.
    #[arg(long, requires = "precision")]
    absolute: bool,
}

fn width(text: &str) -> Result<f64, String> {
    let wrong = || format!("`{text}` is not a positive number such as 1e-6");
    text.parse::<f64>().ok().filter(|width| *width > 0.0 && width.is_finite()).ok_or_else(wrong)
}

struct Queries {
    listed: Vec<Listed>,
    declarations: Declarations,
    file: String,
    text: String,
}

struct CombinationResult<'a> {
    combination: &'a Combination,
    reports: Vec<Result<Report, Error>>,
}

pub fn run(arguments: &Arguments, common: &Common) -> Result<Exit, Failure> {
    let _guard = arguments.time.guard(common)?;
    let file = source(&arguments.model)?;
    let model_text = (file.name(), file.text());
    let model = prism::parse(file.text()).map_err(|error| process_failure(error, model_text, ("", "")))?;
    let mut queries = asked(arguments)?;
    let declarations = std::mem::take(&mut queries.declarations);
    let (file, text) = (queries.file.clone(), queries.text.clone());
    let failed = |error| process_failure(error, model_text, (&file, &text));
    let value_combinations = combinations(&arguments.constants)?;
    let is_series = value_combinations.len() > 1;
    if is_series && arguments.policy.is_some() {
        return Err(Failure::usage(Message::error(
            "M107",
            "a policy is written for one value of each constant",
        )));
    }
    let progress = Progress::new("checking", common);
    let evaluate = arguments.evaluate.as_deref().map(read_policy).transpose()?;
    let (model, listed, declarations) = (&model, &queries.listed[..], &declarations);
    let checked = CheckContext { arguments, model, listed, declarations, evaluate, progress: &progress };
    let mut answered = Vec::new();
    for combination in &value_combinations {
        let reports = checked.check(combination).map_err(|error| combination.named_in(failed(error)))?;
        answered.push(CombinationResult { combination, reports });
    }
    progress.finish();
    if queries.listed.len() == 1 && !is_series && arguments.props.is_none() {
        if let (Some(path), [one]) = (&arguments.csv, &answered[..]) {
            let rows = [(one.combination, &one.reports[..])];
            output::write_file(path, &csv(&[&queries.listed[0].text[..]], &rows))?;
        }
        let report = answered.swap_remove(0).reports.swap_remove(0).map_err(failed)?;
        return single(arguments, common, &queries.listed[0].text, &report);
    }
    write_all(arguments, common, &queries.listed, &answered)?;
    let mut messages = Vec::new();
    let mut exit = Exit::Done;
    for report in answered.into_iter().flat_map(|answered| answered.reports) {
        match report {
            Ok(report) if !is_proved(arguments, &report) => exit = Exit::NotProved,
            Ok(_) => {}
            Err(error) => messages.extend(failed(error).messages),
        }
    }
    messages.dedup_by(|a, b| a.text() == b.text());
    if messages.is_empty() {
        return Ok(exit);
    }
    // JSON answers contain these messages in `refused`.
    if common.format != Format::Json {
        output::warnings(common, &messages);
    }
    Ok(Exit::BadInput)
}

fn asked(arguments: &Arguments) -> Result<Queries, Failure> {
    let Some(path) = &arguments.props else {
        let text = arguments.property.clone().unwrap_or_default();
        let property =
            property::parse(&text).map_err(|error| process_failure(error, ("", ""), ("property", &text)))?;
        let listed =
            vec![Listed { name: None, property, text: text.clone(), place: probabilistic::Place::default() }];
        return Ok(Queries {
            listed,
            declarations: Declarations::default(),
            file: "property".to_owned(),
            text,
        });
    };
    let file = source(path)?;
    let parsed = property::parse_file(file.text())
        .map_err(|error| process_failure(error, ("", ""), (file.name(), file.text())))?;
    let (name, text) = (file.name().to_owned(), file.text().to_owned());
    let property::File { declarations, properties } = parsed;
    if arguments.prop.is_empty() {
        return Ok(Queries { listed: properties, declarations, file: name, text });
    }
    let mut listed = Vec::new();
    for wanted in &arguments.prop {
        let number = wanted.parse::<usize>().ok().and_then(|number| number.checked_sub(1));
        let named = properties.iter().find(|property| property.name.as_ref() == Some(wanted));
        let Some(property) = named.or_else(|| properties.get(number?)) else {
            let names: Vec<_> = properties.iter().filter_map(|property| property.name.as_deref()).collect();
            let text = format!(
                "there is no property `{wanted}` in {name}, which has {}; their names: {}",
                properties.len(),
                names.join(", ")
            );
            return Err(Failure::usage(Message::error("M107", text)));
        };
        listed.push(property.clone());
    }
    Ok(Queries { listed, declarations, file: name, text })
}

struct CheckContext<'a> {
    arguments: &'a Arguments,
    model: &'a Model,
    listed: &'a [Listed],
    declarations: &'a Declarations,
    evaluate: Option<PolicyTable>,
    progress: &'a Progress,
}

impl CheckContext<'_> {
    fn check(&self, combination: &Combination) -> Result<Vec<Result<Report, Error>>, Error> {
        let CheckContext { arguments, model, listed, declarations, evaluate, progress } = self;
        let report_states = |states: usize| {
            progress.set_message(format!("{states} states"));
            true
        };
        let options = Options::default()
            .with_settings(combination.settings.clone())
            .with_bounds(Bounds::default().with_states(arguments.state_limit).with_progress(&report_states))
            .with_exactness(match (arguments.exact, arguments.inexact) {
                (true, _) => Exactness::Always,
                (_, true) => Exactness::Never,
                _ => Exactness::Auto,
            })
            .with_secondary(arguments.secondary.clone())
            .with_policy(arguments.policy.is_some())
            .with_evaluation(evaluate.clone())
            .with_precision(precision(arguments))
            .with_declarations((*declarations).clone());
        check_all(model, listed.iter().map(|listed| &listed.property), &options)
    }
}

fn precision(arguments: &Arguments) -> Option<Precision> {
    let Tightness { precision, absolute, .. } = arguments.tightness;
    precision.map(if absolute { Precision::Absolute } else { Precision::Relative })
}

fn is_proved(arguments: &Arguments, report: &Report) -> bool {
    let fits = precision(arguments).is_none_or(|precision| report.outcome.is_within(precision));
    let is_open = matches!(
        report.outcome,
        Outcome::Undecided(_) | Outcome::Constrained { randomised: Answer::Undefined, proved: false, .. }
    );
    fits && !is_open
}

fn single(arguments: &Arguments, common: &Common, property: &str, report: &Report) -> Result<Exit, Failure> {
    if let Some(path) = &arguments.policy {
        let Some(policy) = &report.policy else {
            let text = "this property has no policy to write; ask for one value with `F`, `G` or `U` without a bound \
                        such as `<=6`";
            return Err(Failure::usage(Message::error("M107", text)));
        };
        output::write_file(path, &output::pretty(&policy.to_json()))?;
    }
    match common.format {
        Format::Json => output::json_answer(&CheckAnswer::new(property, report)),
        _ => output::answer(&as_text(report, common.verbose)),
    }
    Ok(if is_proved(arguments, report) { Exit::Done } else { Exit::NotProved })
}

fn write_all(
    arguments: &Arguments,
    common: &Common,
    listed: &[Listed],
    answered: &[CombinationResult<'_>],
) -> Result<(), Failure> {
    let heads: Vec<&str> =
        listed.iter().map(|listed| listed.name.as_deref().unwrap_or(&listed.text)).collect();
    let rows: Vec<_> =
        answered.iter().map(|answered| (answered.combination, &answered.reports[..])).collect();
    if let Some(path) = &arguments.csv {
        output::write_file(path, &csv(&heads, &rows))?;
    }
    if common.format == Format::Json {
        let mut answers = Vec::new();
        for CombinationResult { combination, reports } in answered {
            for (listed, report) in listed.iter().zip(reports) {
                let Ok(report) = report else { continue };
                let constants = combination.varied.iter().map(|(name, value)| (&name[..], &value[..]));
                answers.push(CheckAnswer::new(&listed.text, report).told(listed.name.as_deref(), constants));
            }
        }
        let mut answer = ChecksAnswer::new(answers);
        for CombinationResult { reports, .. } in answered {
            for (listed, report) in listed.iter().zip(reports) {
                if let Err(error) = report {
                    answer.refuse(&listed.text, listed.name.as_deref(), said(error));
                }
            }
        }
        output::json_answer(&answer);
    } else if answered.len() > 1 {
        output::answer(&table(&heads, &rows));
    } else {
        let mut text = String::new();
        for (head, report) in heads.iter().zip(&answered[0].reports) {
            let content =
                report.as_ref().map_or("no answer\n".to_owned(), |report| as_text(report, common.verbose));
            let between = if content.trim_end().contains('\n') { "\n" } else { " " };
            let _ = write!(text, "{head}:{between}{content}");
        }
        output::answer(&text);
    }
    Ok(())
}

fn said(error: &Error) -> Vec<String> {
    match error.diagnostics() {
        [] => vec![error.to_string()],
        problems => problems.iter().map(|problem| problem.message.clone()).collect(),
    }
}

fn read_policy(path: &Path) -> Result<PolicyTable, Failure> {
    let file = source(path)?;
    let named = (file.name(), file.text());
    PolicyTable::from_json(file.text()).map_err(|error| process_failure(error, named, ("property", "")))
}
