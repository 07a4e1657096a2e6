//! What was heard of reconfigurations: which was acknowledged last for each function, and which were superseded without an answer.
//! [`super::acknowledge`] says what is believed of them.

use std::collections::BTreeMap;

use serde_json::{Value, json};

/// Upper limit on the superseded reconfigurations that are kept for each function.
const MAX_SUPERSEDED: usize = 16;

/// Acknowledgements so far.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct Receipts {
    /// Whether a reconfiguration was ever acknowledged by its number.
    pub(super) by_number: bool,
    pub(super) functions: BTreeMap<String, Received>,
}

/// Acknowledgements of one function's reconfigurations.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct Received {
    pub(super) last: Option<Acknowledged>,
    /// Reconfigurations that were superseded and never answered, by number, with their design.
    pub(super) superseded: BTreeMap<u64, String>,
    /// The greatest number of an effect when the function was seen with a design that was neither the believed nor the pending one;
    /// 0 if it never was. Such a reconfiguration may have been carried out before or after.
    pub(super) doubted: u64,
}

/// The greatest reconfiguration that was acknowledged.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Acknowledged {
    pub(super) effect: u64,
    pub(super) design: String,
    /// The design before, where it is known.
    pub(super) before: Option<Before>,
    /// Whether it has failed after it was acknowledged.
    pub(super) failed: bool,
}

/// The design that a function had before a reconfiguration.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Before {
    pub(super) design: String,
    /// Number of the reconfiguration by which the function had got it; `None` if it was observed.
    pub(super) effect: Option<u64>,
}

impl Receipts {
    /// Returns `true` if the robot acknowledges reconfigurations by their number.
    pub(super) fn are_sent(&self) -> bool {
        self.by_number
    }

    /// Returns `true` if a reconfiguration of the function was superseded and never answered. It may still be on its way, also when the function
    /// was observed since.
    pub(super) fn has_superseded(&self, function: &str) -> bool {
        self.functions.get(function).is_some_and(|own| !own.superseded.is_empty())
    }

    /// Notes that a reconfiguration was superseded before it was answered.
    pub(super) fn supersede(&mut self, effect: u64, function: String, design: String) {
        let superseded = &mut self.functions.entry(function).or_default().superseded;
        superseded.insert(effect, design);
        if superseded.len() > MAX_SUPERSEDED {
            superseded.pop_first();
        }
    }

    /// Notes that a function was seen. If no reconfiguration is pending it is certain which design it has; otherwise acknowledgements
    /// of those up to `doubted` are not.
    pub(super) fn observe(&mut self, function: &str, doubted: Option<u64>, is_pending: bool) {
        if !is_pending && let Some(own) = self.functions.get_mut(function) {
            let last = own.superseded.last_key_value().map_or(0, |(number, _)| *number);
            own.doubted = own.doubted.max(last);
        }
        if let Some(doubted) = doubted {
            self.functions.entry(function.to_owned()).or_default().doubted = doubted;
        }
    }

    /// Numbers of the reconfigurations of a function that were superseded and never answered.
    pub(super) fn unanswered(&self, function: &str) -> impl Iterator<Item = &u64> {
        self.functions.get(function).into_iter().flat_map(|own| own.superseded.keys())
    }

    /// Returns the superseded reconfiguration with that number.
    pub(super) fn superseded(&self, effect: u64) -> Option<(&String, &String)> {
        let design = |(function, own)| Some((function, Received::superseded(own, effect)?));
        self.functions.iter().find_map(design)
    }

    /// For a snapshot.
    pub(super) fn to_record(&self) -> Value {
        let function = |(name, own): (&String, &Received)| {
            let last = own.last.as_ref().map(|last| {
                let before = last.before.as_ref().map(|before| json!([before.design, before.effect]));
                json!([last.effect, last.design, before, last.failed])
            });
            json!([name, last, own.superseded.iter().collect::<Vec<_>>(), own.doubted])
        };
        json!([self.by_number, self.functions.iter().map(function).collect::<Vec<_>>()])
    }

    /// The inverse of [`Receipts::to_record`].
    pub(super) fn from_record(record: &Value) -> Option<Self> {
        let text = |value: &Value| value.as_str().map(ToOwned::to_owned);
        let superseded = |pair: &Value| Some((pair.get(0)?.as_u64()?, text(pair.get(1)?)?));
        let before =
            |pair: &Value| Some(Before { design: text(pair.get(0)?)?, effect: pair.get(1)?.as_u64() });
        let function = |record: &Value| {
            let last = match record.get(1)? {
                Value::Null => None,
                last => Some(Acknowledged {
                    effect: last.get(0)?.as_u64()?,
                    design: text(last.get(1)?)?,
                    before: before(last.get(2)?),
                    failed: last.get(3)?.as_bool()?,
                }),
            };
            let superseded = record.get(2)?.as_array()?.iter().map(superseded).collect::<Option<_>>()?;
            let doubted = record.get(3)?.as_u64()?;
            Some((text(record.get(0)?)?, Received { last, superseded, doubted }))
        };
        let functions = record.get(1)?.as_array()?.iter().map(function).collect::<Option<_>>()?;
        Some(Self { by_number: record.get(0)?.as_bool()?, functions })
    }
}

impl Received {
    fn superseded(&self, effect: u64) -> Option<&String> {
        self.superseded.get(&effect)
    }
}
