//! Filters between what sensors report and what is believed: a pure function of samples, reports and their times.
//!
//! [`Filters`] is the configuration, from the section `adaptation` of a manifest and the bounds of the knowledge base;
//! [`FilterStates`] is the memory, a part of the beliefs and of snapshots. No filter has a clock: time comes with observations.

mod attribute;
mod component;
mod section;
mod settings;

use std::collections::BTreeMap;
use std::time::Duration;

use num_rational::BigRational;
use num_traits::{Signed as _, Zero as _};
use ontology::tomasys::change::Status;
use ontology::vocab::{local_name, tomasys};
use serde_json::{Value, json};

pub use attribute::Stale;
use attribute::{AttributeFilter, AttributeState, Bound, Elapsed, Side, Verdict};
use component::{ComponentFilter, ComponentState, word};
pub(crate) use section::{ComponentsSection, MeasuredsSection, filters};
use settings::micros;
pub use settings::{ComponentTimes, FilterSettings, MeasuredSettings};

use crate::knowledge::{Knowledge, RobotReport};
use crate::mapek::answer::Answer;
use crate::message::Message;
use crate::number;

impl FilterSettings {
    /// Attributes that switch designs and whose noise does so, too, each with the reason; for `lint`.
    pub(crate) fn doubts(&self, knowledge: Option<&Knowledge>) -> Vec<Message> {
        let filters = Filters::new(self, knowledge);
        let is_noisy = |(_, filter): &(&String, &AttributeFilter)| {
            let is_damped = filter.debounce > 0 || filter.agree > 1;
            !is_damped && filter.bounds.iter().any(|bound| bound.band.is_zero())
        };
        let noisy = filters.measured.iter().filter(is_noisy).map(|(name, filter)| {
            let bounds = filter.bounds.iter().filter(|bound| bound.band.is_zero());
            let bounds: Vec<String> = bounds.map(|bound| number::decimal(&bound.value)).collect();
            let text = format!("noise of `{name}` at {} switches designs with every sample: it has neither hysteresis nor debounce", bounds.join(", "));
            Message::warning("M144", text)
                .with_help(format!("set `hysteresis` or `debounce` in `[adaptation.measured.{name}]`"))
        });
        let mut doubts: Vec<Message> = noisy.collect();
        if self.heal_time.is_zero() && filters.has_components {
            let text = "a component that comes and goes switches designs with every report: `heal_time` is 0";
            doubts.push(
                Message::warning("M144", text).with_help("set `heal_time` in `[adaptation]` to some seconds"),
            );
        }
        doubts
    }
}

/// Filters of a knowledge base, by local name.
#[derive(Debug, Clone)]
pub(crate) struct Filters {
    measured: BTreeMap<String, AttributeFilter>,
    components: BTreeMap<String, ComponentFilter>,
    others: ComponentFilter,
    has_components: bool,
}

/// Memory of all filters.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct FilterStates {
    measured: BTreeMap<String, AttributeState>,
    components: BTreeMap<String, ComponentState>,
}

/// Something that is believed from now on.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Accepted {
    /// The value of an attribute, by local name.
    Value(String, BigRational),
    /// The status of a component, by local name or IRI.
    Status(String, Status),
    /// An attribute has no known value.
    Unknown(String),
}

impl Filters {
    /// Filters as the settings say, with the bounds of a knowledge base.
    pub(crate) fn new(settings: &FilterSettings, knowledge: Option<&Knowledge>) -> Self {
        let mut bounds = knowledge.map(stated_bounds).unwrap_or_default();
        for name in settings.measured.keys() {
            bounds.entry(name.clone()).or_default();
        }
        let nothing = MeasuredSettings::default();
        let measured = bounds.into_iter().map(|(name, mut bounds)| {
            let own = settings.measured.get(&name).unwrap_or(&nothing);
            // On which side of such a bound a design can be used is not known.
            bounds.extend(
                own.bounds
                    .iter()
                    .flat_map(|bound| [(bound.clone(), Side::Least), (bound.clone(), Side::Most)]),
            );
            bounds.sort();
            bounds.dedup();
            let band = |value: &BigRational| {
                own.hysteresis.clone().unwrap_or_else(|| (value * &settings.band).abs())
            };
            let bounds = bounds.into_iter().map(|(value, side)| Bound { band: band(&value), value, side });
            (name, own.filter(bounds.collect()))
        });
        let times = |own: &ComponentTimes| ComponentFilter {
            confirm: micros(own.confirm_time.unwrap_or(settings.confirm_time)),
            heal: micros(own.heal_time.unwrap_or(settings.heal_time)),
        };
        Self {
            measured: measured.collect(),
            components: settings.components.iter().map(|(name, own)| (name.clone(), times(own))).collect(),
            others: times(&ComponentTimes::default()),
            has_components: knowledge.is_some_and(|knowledge| !knowledge.view().components().is_empty()),
        }
    }

    /// The memory of filters that believe what the knowledge base states.
    pub(crate) fn states(&self, knowledge: Option<&Knowledge>) -> FilterStates {
        let Some(knowledge) = knowledge else { return FilterStates::default() };
        let view = knowledge.view();
        let values = view.measurements().into_iter().map(|own| (own.attribute, own.value));
        let values: BTreeMap<String, Option<BigRational>> = values.collect();
        let state = |name: &String| AttributeState::believing(values.get(name).cloned().flatten());
        let statuses = view.components().into_iter().filter_map(|own| {
            let has_failed = ["FALSE", "ERROR", "false"].contains(&own.status?.as_str());
            // A recovery is confirmed only from a failure that was reported: what the mission states is corrected at once.
            (!has_failed).then(|| (own.individual.name, ComponentState::believing(Some(false))))
        });
        FilterStates {
            measured: self.measured.keys().map(|name| (name.clone(), state(name))).collect(),
            components: statuses.collect(),
        }
    }

    /// Takes a sample of an attribute; returns the value that is believed from now on, if the sample is not held back.
    pub(crate) fn sample(
        &self,
        states: &mut FilterStates,
        now: Duration,
        attribute: &str,
        value: &BigRational,
        answers: &mut Vec<Answer>,
    ) -> Option<BigRational> {
        let name = local_name(attribute);
        let Some(filter) = self.measured.get(name) else { return Some(value.clone()) };
        let state = states.measured.entry(name.to_owned()).or_default();
        match filter.sample(state, micros(now), value) {
            Verdict::Accepted(value) => Some(value),
            Verdict::Held(hold) => {
                if is_told(state.held) {
                    answers.push(Answer::Filtered {
                        name: name.to_owned(),
                        value: number::to_json(value),
                        because: hold.word(),
                        held: state.held,
                        due: filter
                            .due(state)
                            .filter(|_| hold == attribute::Hold::Debounce)
                            .map(Duration::from_micros),
                    });
                }
                None
            }
        }
    }

    /// Takes a report of a component; returns `true` if it is believed from now on.
    pub(crate) fn report(
        &self,
        states: &mut FilterStates,
        now: Duration,
        component: &str,
        status: Status,
        answers: &mut Vec<Answer>,
    ) -> bool {
        let name = local_name(component);
        let filter = self.components.get(name).unwrap_or(&self.others);
        let state = states.components.entry(name.to_owned()).or_default();
        let is_believed = filter.report(state, micros(now), status);
        if !is_believed && is_told(state.held) {
            answers.push(Answer::Filtered {
                name: name.to_owned(),
                value: json!(word(status)),
                because: if status == Status::Failed { "confirm" } else { "heal" },
                held: state.held,
                due: filter.due(state).map(Duration::from_micros),
            });
        }
        is_believed
    }

    /// Time at which something becomes due without a report.
    pub(crate) fn due(&self, states: &FilterStates) -> Option<Duration> {
        let measured =
            self.measured.iter().filter_map(|(name, filter)| filter.due(states.measured.get(name)?));
        let components = states
            .components
            .iter()
            .filter_map(|(name, state)| self.components.get(name).unwrap_or(&self.others).due(state));
        measured.chain(components).min().map(Duration::from_micros)
    }

    /// What has become due up to a time.
    pub(crate) fn elapse(
        &self,
        states: &mut FilterStates,
        now: Duration,
        answers: &mut Vec<Answer>,
    ) -> Vec<Accepted> {
        let now = micros(now);
        let mut accepted = Vec::new();
        for (name, filter) in &self.measured {
            let Some(state) = states.measured.get_mut(name) else { continue };
            AttributeFilter::begin(state, now);
            while let Some(elapsed) = filter.elapse(state, now) {
                let value = match elapsed {
                    Elapsed::Accepted(value) => Some(value),
                    Elapsed::Silent(worst) => {
                        let (stale, value) = (filter.stale, worst.as_ref().map(number::to_json));
                        answers.push(Answer::Silent { name: name.clone(), outcome: stale.word(), value });
                        if stale == Stale::Unknown {
                            accepted.push(Accepted::Unknown(name.clone()));
                        }
                        worst
                    }
                };
                accepted.extend(value.map(|value| Accepted::Value(name.clone(), value)));
            }
        }
        for (name, state) in &mut states.components {
            let filter = self.components.get(name).unwrap_or(&self.others);
            let status = filter.elapse(state, now);
            accepted.extend(status.map(|status| Accepted::Status(name.clone(), status)));
        }
        accepted
    }
}

impl Accepted {
    /// The report for the knowledge base.
    pub(crate) fn report(&self) -> (&str, RobotReport) {
        match self {
            Self::Value(name, value) => (name, RobotReport::measured(value)),
            Self::Status(name, status) => (name, RobotReport::Component(*status)),
            Self::Unknown(name) => (name, RobotReport::Unmeasured),
        }
    }
}

impl FilterStates {
    /// For a snapshot.
    pub(crate) fn to_record(&self) -> Value {
        let measured = self.measured.iter().map(|(name, own)| (name.clone(), own.to_record()));
        let components = self.components.iter().map(|(name, own)| (name.clone(), own.to_record()));
        json!([Value::Object(measured.collect()), Value::Object(components.collect())])
    }

    /// Inverse of [`FilterStates::to_record`].
    pub(crate) fn from_record(record: &Value) -> Option<Self> {
        let [measured, components] = record.as_array()?.as_slice() else { return None };
        let measured = measured.as_object()?.iter();
        let components = components.as_object()?.iter();
        Some(Self {
            measured: measured
                .map(|(name, own)| Some((name.clone(), AttributeState::from_record(own)?)))
                .collect::<Option<_>>()?,
            components: components
                .map(|(name, own)| Some((name.clone(), ComponentState::from_record(own)?)))
                .collect::<Option<_>>()?,
        })
    }
}

/// Bounds on measured attributes that the designs of a knowledge base state, by the local name of the attribute.
fn stated_bounds(knowledge: &Knowledge) -> BTreeMap<String, Vec<(BigRational, Side)>> {
    let view = knowledge.view();
    let operator = |iri: &str| {
        let property = format!("{}qa_comparison_operator", tomasys::NS);
        let value = view.values(iri, &property).into_iter().next()?;
        value.as_literal().map(rules::Literal::lexical)
    };
    let kinds = view.attribute_types().into_iter();
    // A measurement for which `measured OPERATOR estimation` holds rules a design of MROS out.
    let compared: BTreeMap<String, Side> = kinds
        .filter_map(|kind| match operator(&kind.iri)?.as_str() {
            "<" | "<=" => Some((kind.name, Side::Least)),
            ">" | ">=" => Some((kind.name, Side::Most)),
            _ => None,
        })
        .collect();
    let mut bounds: BTreeMap<String, Vec<(BigRational, Side)>> = BTreeMap::new();
    for design in view.function_designs() {
        for requirement in design.requirements {
            let own = bounds.entry(requirement.attribute).or_default();
            own.extend(requirement.minimum.map(|minimum| (minimum, Side::Least)));
            own.extend(requirement.maximum.map(|maximum| (maximum, Side::Most)));
        }
        for (attribute, estimation) in design.estimations {
            if let Some(side) = compared.get(&attribute) {
                bounds.entry(attribute).or_default().push((estimation, *side));
            }
        }
    }
    bounds
}

/// Returns `true` for the first, tenth, hundredth … sample that is held back.
fn is_told(held: u64) -> bool {
    held > 0 && 10_u64.checked_pow(held.ilog10()) == Some(held)
}

#[cfg(test)]
mod tests;
