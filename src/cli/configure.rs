//! The command `metaplan configure`, which chooses designs without a task plan, and the arguments that it shares with
//! `metaplan run --configure`.

use std::fmt::Write as _;
use std::path::PathBuf;

use crate::answers::ConfigureAnswer;
use crate::configure::{Choice, Configuration, Configurator, Goal, Verdict, Wishes, Worth};
use crate::knowledge::Knowledge;
use crate::message::{Message, did_you_mean};
use clap::Args;
use num_rational::BigRational;

use crate::cli::common::{Common, Exit, Failure, Format};
use crate::cli::limits::TimeLimit;
use crate::cli::output;
use crate::cli::progress::during;
use crate::cli::situation::{Imports, consistent, knowledge};
use crate::cli::values::{amount, setting};

/// Arguments of `configure`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// Knowledge bases (OWL in RDF/XML, Turtle, N-Triples, OWL/XML or functional syntax).
    #[arg(required = true, value_name = "KB")]
    documents: Vec<PathBuf>,
    /// Additional rules: a file, `coadaptation` or `tomasys` (repeatable).
    #[arg(long = "rules", value_name = "FILE")]
    rules: Vec<String>,
    #[command(flatten)]
    imports: Imports,
    /// Set a measured attribute to a value (repeatable).
    #[arg(long = "set", value_name = "ATTRIBUTE=VALUE", value_parser = setting)]
    set: Vec<(String, String)>,
    /// Mark a component as failed (repeatable).
    #[arg(long, value_name = "COMPONENT")]
    fail: Vec<String>,
    #[command(flatten)]
    time: TimeLimit,
    #[command(flatten)]
    wanted: Wanted,
}

/// Options that state which functions need a design, what restricts the choice (budgets, exclusive components), and
/// which designs are preferred (by requirements, then by the value of an attribute).
#[derive(Debug, Clone, Default, Args)]
pub(super) struct Wanted {
    /// A required function, in addition to the objectives of the knowledge base (repeatable). Default: all
    /// functions if the knowledge base has no objectives.
    #[arg(long = "objective", value_name = "FUNCTION")]
    objectives: Vec<String>,
    /// Prefer designs for FUNCTION whose estimation of ATTRIBUTE satisfies a bound (repeatable). The rules of the
    /// knowledge base state whether BOUND is the least or the greatest value. If `--objective` is used or the
    /// knowledge base has objectives, this requires `--objective FUNCTION`.
    #[arg(long = "require", value_name = "FUNCTION.ATTRIBUTE=BOUND", value_parser = requirement)]
    requirements: Vec<(String, String, BigRational)>,
    /// Upper limit on the sum of an attribute's estimations over all designs in use (repeatable).
    #[arg(long = "budget", value_name = "ATTRIBUTE=MOST", value_parser = amount)]
    budgets: Vec<(String, BigRational)>,
    /// Component that only one design can use at a time (repeatable).
    #[arg(long = "exclusive", value_name = "COMPONENT")]
    exclusive: Vec<String>,
    /// Prefer designs with high values of this attribute, instead of MROS's utility.
    #[arg(long, value_name = "ATTRIBUTE", conflicts_with = "least")]
    most: Option<String>,
    /// Prefer designs with low values of this attribute, instead of MROS's utility.
    #[arg(long, value_name = "ATTRIBUTE")]
    least: Option<String>,
}

fn requirement(text: &str) -> Result<(String, String, BigRational), String> {
    let wrong =
        || format!("`{text}` is not of the form FUNCTION.ATTRIBUTE=BOUND, such as `f_move.safety=0.5`");
    let (name, _) = text.split_once('=').ok_or_else(wrong)?;
    let (function, attribute) = name.split_once('.').ok_or_else(wrong)?;
    let (_, bound) = amount(text)?;
    Ok((function.trim().to_owned(), attribute.trim().to_owned(), bound))
}

impl Wanted {
    pub(super) fn is_empty(&self) -> bool {
        self.objectives.is_empty()
            && self.requirements.is_empty()
            && self.budgets.is_empty()
            && self.exclusive.is_empty()
            && self.most.is_none()
            && self.least.is_none()
    }

    /// Creates the configurator for a knowledge base, with the functions of `--objective` as additional objectives.
    /// Without this option and without objectives in the knowledge base, all functions are objectives.
    ///
    /// # Errors
    /// All names in the options that are not in the knowledge base, negative budgets, and
    /// requirements for functions that are not added as objectives here.
    pub(super) fn configurator(&self, knowledge: Knowledge) -> Result<Configurator, Failure> {
        let worth = match (&self.most, &self.least) {
            (Some(attribute), _) => Worth::Most(attribute.clone()),
            (_, Some(attribute)) => Worth::Least(attribute.clone()),
            _ => Worth::Mros,
        };
        let exclusive = self.exclusive.iter().cloned().collect();
        let wishes = Wishes { worth, budgets: self.budgets.clone(), exclusive };
        let (mut configurator, mut wrong) = match Configurator::new(knowledge.clone(), wishes) {
            Ok(configurator) => (configurator, Vec::new()),
            // Further faults are reported together with these.
            Err(wrong) => (Configurator::new(knowledge, Wishes::default())?, wrong.into_vec()),
        };
        let functions = if self.objectives.is_empty() && configurator.objectives().is_empty() {
            configurator.all_functions()
        } else {
            self.objectives.clone()
        };
        for (function, attribute, _) in &self.requirements {
            if !functions.contains(function) {
                wrong.push(self.without_objective((function.as_str(), attribute.as_str()), &configurator));
            }
        }
        for function in &functions {
            let requirements = self.requirements.iter().filter(|(of, ..)| of == function);
            let requirements =
                requirements.map(|(_, attribute, bound)| (attribute.clone(), bound.clone())).collect();
            wrong.extend(configurator.pursue(&Goal { requirements, ..Goal::of(function) }).err());
        }
        if wrong.is_empty() {
            Ok(configurator)
        } else {
            Err(Failure { exit: Exit::Usage, messages: wrong.into() })
        }
    }

    fn without_objective(&self, (function, attribute): (&str, &str), configurator: &Configurator) -> Message {
        let functions = configurator.functions();
        if !functions.iter().any(|existing| existing == function) {
            let suggestion = did_you_mean(function, functions.iter().map(String::as_str));
            let text = format!(
                "`--require {function}.{attribute}`: the knowledge base has no function `{function}` that a design \
                 solves; it has: {}{suggestion}",
                functions.join(", ")
            );
            return Message::error("M140", text);
        }
        let reason = if self.objectives.is_empty() {
            "the objectives of the knowledge base have only the requirements that it states".to_owned()
        } else {
            format!("the functions of `--objective` are: {}", self.objectives.join(", "))
        };
        let text = format!("`--require {function}.{attribute}` needs `--objective {function}`: {reason}");
        Message::error("M107", text).with_help(format!("add `--objective {function}`"))
    }
}

pub fn run(arguments: &Arguments, common: &Common) -> Result<Exit, Failure> {
    let Arguments { documents, rules, imports, set, fail, time, wanted } = arguments;
    let guard = time.guard(common)?;
    let knowledge = during("reading", common, || knowledge(documents, rules, imports, fail, set))?;
    output::warnings(common, knowledge.warnings());
    let configurator = wanted.configurator(knowledge)?;
    consistent(Some(configurator.knowledge()))?;
    let configuration = during("choosing", common, || configurator.choose(&guard.plan()))?;
    let notes = notes(&configuration);
    output::warnings(common, &notes);
    match common.format {
        Format::Json => {
            let warnings = [configurator.knowledge().warnings(), &notes].concat();
            output::json_answer(&ConfigureAnswer::new(&configuration, &warnings));
        }
        _ => output::answer(&text(&configuration, &configurator)),
    }
    let is_served = configuration.choices.iter().all(|choice| choice.design.is_some());
    Ok(match (is_served, configuration.optimal) {
        (_, false) => Exit::NotProved,
        (true, true) => Exit::Done,
        (false, true) => Exit::Unsolvable,
    })
}

/// Returns warnings about the choice.
fn notes(configuration: &Configuration) -> Vec<Message> {
    let violated = configuration.violated.iter().map(|violation| {
        let text = format!("objectives that need no design keep theirs, but {violation}");
        let help = "state `o_always_improve` for an objective, so that a design is chosen for it, too";
        Message::warning("M146", text).with_help(help)
    });
    let unestimated = configuration.unestimated.iter().map(|design| {
        let text = format!("{design}, but other designs of its function have one");
        let help = "state the estimation in the knowledge base (`hasQAestimation`)";
        Message::warning("M147", text).with_help(help)
    });
    violated.chain(unestimated).collect()
}

fn text(configuration: &Configuration, configurator: &Configurator) -> String {
    let mut text = String::new();
    if configuration.choices.is_empty() {
        return "no objective needs a new design\n".to_owned();
    }
    let rows = configuration.choices.iter().map(|choice| {
        let function = choice.function.clone().unwrap_or_default();
        let chosen = choice.considered.iter().find(|considered| considered.verdict == Verdict::Chosen);
        let utility = chosen.map(|considered| output::decimal(&considered.utility)).unwrap_or_default();
        let design = choice.design.clone().unwrap_or_else(|| "none can be used".to_owned());
        vec![choice.objective.clone(), function, design, utility, choice.need.join(", ")]
    });
    text += &output::table(&["objective", "function", "design", "utility", "in need, since"], rows);
    let worth = match &configurator.wishes().worth {
        Worth::Mros => "as in MROS: inferred, else the estimated `performance`, else 0.001".to_owned(),
        Worth::Most(attribute) => format!("the estimated {attribute}; more is better"),
        Worth::Least(attribute) => format!("the estimated {attribute}, negated; less is better"),
    };
    let keeps_designs = configurator.objectives().len() > configuration.choices.len();
    let proved = if configuration.optimal && keeps_designs {
        "proved: no choice for these objectives is better; the others keep their designs"
    } else if configuration.optimal {
        "proved: no choice is better"
    } else {
        "not proved: a limit was reached; a better choice may exist"
    };
    let _ =
        writeln!(text, "\nutility: {worth}\ntotal: {}; {proved}", output::decimal(&configuration.utility));
    for choice in &configuration.choices {
        text += &reasons(choice);
    }
    text
}

fn reasons(choice: &Choice) -> String {
    let mut text = String::new();
    for considered in &choice.considered {
        let reasons: Vec<&str> = match &considered.verdict {
            Verdict::Chosen => {
                for missed in &considered.missed {
                    let _ = writeln!(
                        text,
                        "\n{} misses a requirement of {}:\n    {missed}",
                        considered.design, choice.objective
                    );
                }
                continue;
            }
            Verdict::Less => continue,
            Verdict::RuledOut(reasons) => reasons.iter().map(String::as_str).collect(),
            Verdict::Together(reason) => vec![reason],
        };
        let utility = output::decimal(&considered.utility);
        let _ = writeln!(text, "\nnot {} ({utility}) for {}:", considered.design, choice.objective);
        for reason in reasons {
            let _ = writeln!(text, "    {reason}");
        }
    }
    text
}
