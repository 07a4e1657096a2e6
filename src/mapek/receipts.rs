//! History of reconfiguration requests per function: the last acknowledged request, and superseded requests that the
//! robot has not answered. [`super::acknowledge`] derives the believed design from this history.

use std::collections::BTreeMap;

use serde_json::{Value, json};

const MAX_SUPERSEDED: usize = 16;

/// History of acknowledged and superseded reconfigurations, by function. A reconfiguration is superseded if a later
/// request replaces it before its acknowledgement, or if it is not acknowledged in time.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct Receipts {
    pub(super) by_number: bool,
    pub(super) functions: BTreeMap<String, Received>,
}

#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct Received {
    pub(super) last: Option<Acknowledged>,
    /// Superseded reconfigurations without an answer, after the last acknowledged one: maps the effect number to the
    /// requested design.
    pub(super) superseded: BTreeMap<u64, String>,
    /// Reconfigurations up to this effect number are uncertain; 0 for none. It is unknown whether the robot carried
    /// them out before or after a report of the function's design.
    pub(super) doubted: u64,
    /// Effect number of the last reconfiguration whose arrival was only implied by a report of an action. `None` once
    /// this or a later reconfiguration is acknowledged. Copies of the request may still arrive.
    pub(super) implied: Option<u64>,
}

/// The reconfiguration with the greatest number among those that were acknowledged, or implied by a report of an
/// action.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Acknowledged {
    pub(super) effect: u64,
    pub(super) design: String,
    pub(super) before: Option<Before>,
    pub(super) failed: bool,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Before {
    pub(super) design: String,
    /// Effect number of the reconfiguration that had set this design; `None` if it is unknown or failed later, or if
    /// the design was observed without a request.
    pub(super) effect: Option<u64>,
}

impl Receipts {
    /// Returns `true` if the robot has acknowledged any effect explicitly, by its number.
    pub(super) fn are_sent(&self) -> bool {
        self.by_number
    }

    /// Returns `true` if a reconfiguration of the function was superseded, and neither it nor a later one was
    /// answered. The robot may still carry out such a reconfiguration, even after an observation of the function.
    pub(super) fn has_superseded(&self, function: &str) -> bool {
        self.functions.get(function).is_some_and(|history| !history.superseded.is_empty())
    }

    pub(super) fn supersede(&mut self, effect: u64, function: String, design: String) {
        let superseded = &mut self.functions.entry(function).or_default().superseded;
        superseded.insert(effect, design);
        if superseded.len() > MAX_SUPERSEDED {
            superseded.pop_first();
        }
    }

    /// Records a report of a function's design, which can cross messages to the robot. Reconfigurations up to effect
    /// number `doubted` become uncertain, and so do all superseded ones if no reconfiguration of the function is
    /// pending.
    pub(super) fn observe(&mut self, function: &str, doubted: Option<u64>, is_pending: bool) {
        if !is_pending && let Some(history) = self.functions.get_mut(function) {
            let last = history.superseded.last_key_value().map_or(0, |(number, _)| *number);
            history.doubted = history.doubted.max(last);
        }
        if let Some(doubted) = doubted {
            self.functions.entry(function.to_owned()).or_default().doubted = doubted;
        }
    }

    pub(super) fn unanswered_superseded(&self, function: &str) -> impl Iterator<Item = &u64> {
        self.functions.get(function).into_iter().flat_map(|history| history.superseded.keys())
    }

    /// Returns the effect numbers of a function's reconfigurations of which a copy may still be in transit: they were
    /// superseded, or their arrival was only implied, without an acknowledgement.
    pub(super) fn unanswered(&self, function: &str) -> impl Iterator<Item = &u64> {
        let implied = self.functions.get(function).and_then(|history| history.implied.as_ref());
        self.unanswered_superseded(function).chain(implied)
    }

    pub(super) fn superseded(&self, effect: u64) -> Option<(&String, &String)> {
        let design = |(function, history)| Some((function, Received::superseded(history, effect)?));
        self.functions.iter().find_map(design)
    }

    pub(super) fn to_record(&self) -> Value {
        let function = |(name, history): (&String, &Received)| {
            let last = history.last.as_ref().map(|last| {
                let before = last.before.as_ref().map(|before| json!([before.design, before.effect]));
                json!([last.effect, last.design, before, last.failed])
            });
            let superseded = history.superseded.iter().collect::<Vec<_>>();
            json!([name, last, superseded, history.doubted, history.implied])
        };
        json!([self.by_number, self.functions.iter().map(function).collect::<Vec<_>>()])
    }

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
            let implied = record.get(4)?.as_u64();
            Some((text(record.get(0)?)?, Received { last, superseded, doubted, implied }))
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
