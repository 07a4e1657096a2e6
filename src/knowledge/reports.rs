//! Reports of the robot, and what becomes of them where a rule runs away: they stay, and nothing follows until rules come
//! to an end again.
//!
//! An update after which a rule runs away leaves the engine as it was. So the report is kept beside it, with all that come
//! later, and with each new report all of them are told at once: what follows then is what follows for whoever hears the
//! last word on everything.

use std::collections::{BTreeMap, BTreeSet};

use num_rational::BigRational;
use ontology::tomasys::change::{self, Status};
use rules::{Delta, Fact, Limits, Literal, Symbol};
use serde_json::{Value, json};

use super::Knowledge;
use crate::message::Message;

/// What a robot says.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Report {
    /// How a component is.
    Component(Status),
    /// What an attribute measures.
    Measured(Literal),
}

/// That what follows is not known.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Fault {
    /// `R301` or `R304`, as for `reason`.
    pub code: String,
    /// What has happened, in a sentence.
    pub message: String,
    /// The rule that was being evaluated.
    pub rule: String,
}

/// What was told and nothing follows from yet.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Waiting {
    fault: Option<Fault>,
    /// The name of a component or an attribute with the last word on it.
    reports: Vec<(String, Report)>,
    /// Functions with their designs, if the objectives could not be told either.
    objectives: Option<Vec<(String, String)>>,
}

impl Knowledge {
    /// Why it is not known what follows, if it is not: no design counts as available then.
    pub fn fault(&self) -> Option<&Fault> {
        self.waiting.fault.as_ref()
    }

    /// Takes a report over; returns what holds since, and what no more.
    ///
    /// # Errors
    /// There is no such component or attribute.
    pub(crate) fn take(&mut self, name: &str, report: Report) -> Result<Delta, Message> {
        let mut reports = self.waiting.reports.clone();
        reports.retain(|(known, other)| known != name || !other.is_alike(&report));
        reports.push((name.to_owned(), report));
        let delta = self.update(&reports).map_err(|error| Message::from_ontology(&error))?;
        match self.runtime.apply(delta) {
            Ok(delta) => {
                self.waiting.reports.clear();
                self.waiting.fault = None;
                self.follow(&delta);
                if let Some(objectives) = self.waiting.objectives.take() {
                    self.pursue_in_time(&objectives)?;
                }
                Ok(delta)
            }
            Err(error) => {
                self.waiting.reports = reports;
                self.waiting.fault = Some(fault(&error));
                Ok(Delta::default())
            }
        }
    }

    /// The update that tells several reports at once, of which later ones count.
    fn update(&mut self, reports: &[(String, Report)]) -> Result<Delta, ontology::Error> {
        let engine = self.runtime.engine_mut();
        if let [(name, report)] = reports {
            return report.update(engine, name);
        }
        let mut words: BTreeMap<(Symbol, Symbol), Fact> = BTreeMap::new();
        let (mut insert, mut delete) = (BTreeSet::new(), BTreeSet::new());
        for (name, report) in reports {
            let delta = report.update(engine, name)?;
            let word = match report {
                Report::Component(_) => None,
                Report::Measured(value) => engine.symbols().find_literal(value),
            };
            for fact in delta.insert {
                let is_word =
                    matches!(report, Report::Component(_)) || fact.arguments.get(1) == word.as_ref();
                if is_word && fact.arguments.len() == 2 {
                    words.insert((fact.predicate, fact.arguments[0]), fact);
                } else {
                    insert.insert(fact);
                }
            }
            delete.extend(delta.delete);
        }
        insert.extend(words.into_values());
        delete.retain(|fact| !insert.contains(fact));
        Ok(Delta { insert: insert.into_iter().collect(), delete: delete.into_iter().collect() })
    }

    /// As [`Knowledge::pursue`], and later, where what follows is not known.
    ///
    /// # Errors
    /// There is no such function or design.
    pub(crate) fn pursue_in_time(&mut self, configuration: &[(String, String)]) -> Result<(), Message> {
        if self.waiting.reports.is_empty() {
            match self.pursue_now(configuration) {
                Ok(()) => {
                    self.waiting.fault = None;
                    self.waiting.objectives = None;
                    return Ok(());
                }
                Err(error @ ontology::Error::Engine(_)) => self.waiting.fault = Some(fault(&error)),
                Err(error) => return Err(Message::from_ontology(&error)),
            }
        }
        self.waiting.objectives = Some(configuration.to_vec());
        Ok(())
    }

    /// What waits, for a snapshot.
    pub(crate) fn waiting(&self) -> &Waiting {
        &self.waiting
    }

    /// Lets wait what waited when a snapshot was made.
    pub(crate) fn set_waiting(&mut self, waiting: Waiting) {
        self.waiting = waiting;
    }

    /// From now on an update may take so many steps; see [`rules::Limits`].
    pub(crate) fn limit(&mut self, steps: u64) {
        let limits = Limits { steps, ..self.sources.limits.clone() };
        self.runtime.engine_mut().set_limits(limits);
    }
}

impl Report {
    fn is_alike(&self, other: &Self) -> bool {
        matches!(self, Self::Component(_)) == matches!(other, Self::Component(_))
    }

    fn update(&self, engine: &mut rules::Engine, name: &str) -> Result<Delta, ontology::Error> {
        match self {
            Self::Component(status) => change::component_status(engine, name, *status),
            Self::Measured(value) => change::measured_value(engine, name, value.clone()),
        }
    }

    /// A number as it is measured.
    pub(crate) fn measured(value: &BigRational) -> Self {
        Self::Measured(Literal::Decimal(rules::Decimal::from_rational(value)))
    }

    fn to_record(&self) -> (&'static str, String) {
        match self {
            Self::Component(Status::Failed) => ("component", "FALSE".to_owned()),
            Self::Component(Status::Recovered) => ("component", "RECOVERED".to_owned()),
            Self::Component(Status::Working) => ("component", "TRUE".to_owned()),
            Self::Measured(value) => ("measured", value.lexical()),
        }
    }

    fn from_record(kind: &str, word: &str) -> Option<Self> {
        match (kind, word) {
            ("component", "FALSE") => Some(Self::Component(Status::Failed)),
            ("component", "RECOVERED") => Some(Self::Component(Status::Recovered)),
            ("component", "TRUE") => Some(Self::Component(Status::Working)),
            ("measured", number) => {
                let value = Literal::parse(number, Some(ontology::vocab::xsd::DECIMAL), None);
                value.as_rational().is_some().then_some(Self::Measured(value))
            }
            _ => None,
        }
    }
}

impl Waiting {
    /// For a snapshot; null where nothing waits.
    pub(crate) fn to_record(&self) -> Value {
        let Some(fault) = &self.fault else { return Value::Null };
        let reports: Vec<Value> = self
            .reports
            .iter()
            .map(|(name, report)| {
                let (kind, word) = report.to_record();
                json!([name, kind, word])
            })
            .collect();
        json!([[fault.code, fault.message, fault.rule], reports, self.objectives])
    }

    /// The inverse of [`Waiting::to_record`].
    pub(crate) fn from_record(record: &Value) -> Option<Self> {
        if record.is_null() {
            return Some(Self::default());
        }
        let text = |value: &Value| value.as_str().map(ToOwned::to_owned);
        let pair = |pair: &Value| Some((text(pair.get(0)?)?, text(pair.get(1)?)?));
        let report = |report: &Value| {
            let own = Report::from_record(report.get(1)?.as_str()?, report.get(2)?.as_str()?)?;
            Some((text(report.get(0)?)?, own))
        };
        let [fault, reports, objectives] = record.as_array()?.as_slice() else { return None };
        Some(Self {
            fault: Some(Fault {
                code: text(fault.get(0)?)?,
                message: text(fault.get(1)?)?,
                rule: text(fault.get(2)?)?,
            }),
            reports: reports.as_array()?.iter().map(report).collect::<Option<_>>()?,
            objectives: match objectives {
                Value::Null => None,
                pairs => Some(pairs.as_array()?.iter().map(pair).collect::<Option<_>>()?),
            },
        })
    }
}

fn fault(error: &ontology::Error) -> Fault {
    let said = Message::from_ontology(error);
    let rule = match error {
        ontology::Error::Engine(
            rules::Error::BudgetExhausted { rule, .. } | rules::Error::Interrupted { rule },
        ) => rule.label.as_deref().map_or_else(|| rule.to_string(), ToOwned::to_owned),
        _ => String::new(),
    };
    Fault { code: said.code.clone(), message: said.message.clone(), rule }
}
