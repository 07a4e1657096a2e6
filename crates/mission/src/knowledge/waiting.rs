//! Pending reports, whose inferred consequences are not known yet, and their serialisation.

use num_rational::BigRational;
use ontology::tomasys::change::{self, Status};
use rules::{Delta, Literal};
use serde_json::{Value, json};

use crate::message::Message;

/// A report of the robot.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum RobotReport {
    /// Status of a component.
    Component(Status),
    /// Measured value of an attribute.
    Measured(Literal),
    /// The value of an attribute is unknown.
    Unmeasured,
    /// Realisability of a design, reported for the design itself and independent of its components.
    Design(bool),
}

/// Reason why the consequences of reports are unknown.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Fault {
    /// Error code, usually `R301` or `R304` of the rules crate.
    pub code: String,
    /// Description in a sentence.
    pub message: String,
    /// The rule that was being evaluated when inference failed; empty if unknown.
    pub rule: String,
}

/// Reports and objectives that wait for inference to succeed.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Waiting {
    pub(super) fault: Option<Fault>,
    /// Latest report on each component, attribute or design, by name.
    pub(super) reports: Vec<(String, RobotReport)>,
    /// Objectives that could not be set yet: pairs of function and design.
    pub(super) objectives: Option<Vec<(String, String)>>,
}

impl RobotReport {
    pub(super) fn is_alike(&self, other: &Self) -> bool {
        let is_measured = |own: &Self| matches!(own, Self::Measured(_) | Self::Unmeasured);
        std::mem::discriminant(self) == std::mem::discriminant(other)
            || is_measured(self) && is_measured(other)
    }

    pub(super) fn update(&self, engine: &mut rules::Engine, name: &str) -> Result<Delta, ontology::Error> {
        match self {
            Self::Component(status) => change::component_status(engine, name, *status),
            Self::Measured(value) => change::measured_value(engine, name, value.clone()),
            Self::Unmeasured => change::unmeasured(engine, name),
            Self::Design(realisable) => change::design_realisable(engine, name, *realisable),
        }
    }

    /// Creates the report of a measured number.
    pub fn measured(value: &BigRational) -> Self {
        Self::Measured(Literal::Decimal(rules::Decimal::from_rational(value)))
    }

    fn to_record(&self) -> (&'static str, String) {
        match self {
            Self::Component(status) => ("component", status.word().to_owned()),
            Self::Measured(value) => ("measured", value.lexical()),
            Self::Unmeasured => ("unmeasured", String::new()),
            Self::Design(realisable) => ("design", realisable.to_string()),
        }
    }

    fn from_record(kind: &str, word: &str) -> Option<Self> {
        match (kind, word) {
            ("component", word) => Status::from_word(word).map(Self::Component),
            ("unmeasured", _) => Some(Self::Unmeasured),
            ("design", word) => word.parse().ok().map(Self::Design),
            ("measured", number) => {
                let value = Literal::parse(number, Some(ontology::vocab::xsd::DECIMAL), None);
                value.as_rational().is_some().then_some(Self::Measured(value))
            }
            _ => None,
        }
    }
}

impl Waiting {
    /// Serialises the pending reports and objectives for a snapshot; null if inference has not failed.
    pub fn to_record(&self) -> Value {
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

    /// Deserialises the result of [`Waiting::to_record`]. `None` if the record is malformed.
    pub fn from_record(record: &Value) -> Option<Self> {
        if record.is_null() {
            return Some(Self::default());
        }
        let text = |value: &Value| value.as_str().map(ToOwned::to_owned);
        let pair = |pair: &Value| Some((text(pair.get(0)?)?, text(pair.get(1)?)?));
        let report = |report: &Value| {
            let robot_report = RobotReport::from_record(report.get(1)?.as_str()?, report.get(2)?.as_str()?)?;
            Some((text(report.get(0)?)?, robot_report))
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

pub(super) fn fault(error: &ontology::Error) -> Fault {
    let message = Message::from_ontology(error);
    let rule = match error {
        ontology::Error::Engine(
            rules::Error::BudgetExhausted { rule, .. } | rules::Error::Interrupted { rule },
        ) => rule.label.as_deref().map_or_else(|| rule.to_string(), ToOwned::to_owned),
        _ => String::new(),
    };
    Fault { code: message.code.clone(), message: message.message.clone(), rule }
}
