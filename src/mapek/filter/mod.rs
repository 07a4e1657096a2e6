//! Noise filters between the robot's reports and the beliefs. For given settings and bounds, the output depends only on
//! the reports and their times.
//!
//! [`Filters`] is the configuration, from the section `adaptation` of a manifest and the bounds of the knowledge base.
//! [`FilterStates`] is the state, a part of the beliefs and of snapshots. Filters have no clock: observations provide
//! the times.

mod attribute;
mod component;
mod section;
mod settings;

use std::collections::BTreeMap;
use std::time::Duration;

use num_rational::BigRational;
use num_traits::{Signed as _, Zero as _};
use ontology::tomasys::change::{Status, is_failed};
use ontology::vocab::{local_name, tomasys};
use serde_json::{Value, json};

pub use attribute::Stale;
use attribute::{AttributeFilter, AttributeState, Bound, Elapsed, Side, Verdict};
use component::{ComponentFilter, ComponentState};
pub(crate) use section::{ComponentsSection, MeasuredsSection, filters};
use settings::micros;
pub use settings::{ComponentTimes, FilterSettings, MeasuredSettings};

use crate::knowledge::{Knowledge, RobotReport};
use crate::mapek::answer::Answer;
use crate::message::Message;
use crate::number;

impl FilterSettings {
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
            let text = "an intermittent component switches designs with every report: `heal_time` is 0";
            doubts.push(
                Message::warning("M144", text)
                    .with_help("set `heal_time` in `[adaptation]` to a few seconds"),
            );
        }
        doubts
    }
}

#[derive(Debug, Clone)]
pub(crate) struct Filters {
    measured: BTreeMap<String, AttributeFilter>,
    components: BTreeMap<String, ComponentFilter>,
    default_component: ComponentFilter,
    has_components: bool,
}

#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct FilterStates {
    measured: BTreeMap<String, AttributeState>,
    components: BTreeMap<String, ComponentState>,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Accepted {
    Value(String, BigRational),
    Status(String, Status),
    Unknown(String),
}

impl Filters {
    pub(crate) fn new(settings: &FilterSettings, knowledge: Option<&Knowledge>) -> Self {
        let mut bounds = knowledge.map(stated_bounds).unwrap_or_default();
        for name in settings.measured.keys() {
            bounds.entry(name.clone()).or_default();
        }
        let nothing = MeasuredSettings::default();
        let measured = bounds.into_iter().map(|(name, mut bounds)| {
            let entry = settings.measured.get(&name).unwrap_or(&nothing);
            for (values, side) in [
                (&entry.lower_bounds, Side::Least),
                (&entry.upper_bounds, Side::Most),
                (&entry.bounds, Side::Least),
                (&entry.bounds, Side::Most),
            ] {
                bounds.extend(values.iter().map(|value| (value.clone(), side)));
            }
            bounds.sort();
            bounds.dedup();
            let band = |value: &BigRational| {
                entry.hysteresis.clone().unwrap_or_else(|| (value * &settings.band).abs())
            };
            let bounds = bounds.into_iter().map(|(value, side)| Bound { band: band(&value), value, side });
            (name, entry.filter(bounds.collect()))
        });
        let times = |entry: &ComponentTimes| ComponentFilter {
            confirm: micros(entry.confirm_time.unwrap_or(settings.confirm_time)),
            heal: micros(entry.heal_time.unwrap_or(settings.heal_time)),
        };
        Self {
            measured: measured.collect(),
            components: settings
                .components
                .iter()
                .map(|(name, entry)| (name.clone(), times(entry)))
                .collect(),
            default_component: times(&ComponentTimes::default()),
            has_components: knowledge.is_some_and(|knowledge| !knowledge.view().components().is_empty()),
        }
    }

    pub(crate) fn has(&self, attribute: &str) -> bool {
        self.measured.contains_key(attribute)
    }

    /// Returns the initial states. The values stated by the knowledge base are believed, and so are the stated statuses
    /// of components that have not failed.
    pub(crate) fn states(&self, knowledge: Option<&Knowledge>) -> FilterStates {
        let Some(knowledge) = knowledge else { return FilterStates::default() };
        let view = knowledge.view();
        let values = view.measurements().into_iter().map(|element| (element.attribute, element.value));
        let values: BTreeMap<String, Option<BigRational>> = values.collect();
        let state = |name: &String| AttributeState::believing(values.get(name).cloned().flatten());
        let statuses = view.components().into_iter().filter_map(|element| {
            let has_failed = is_failed(&element.status?);
            // Only a reported failure delays a recovery: a failure stated by the mission is corrected at once.
            (!has_failed).then(|| (element.individual.name, ComponentState::believing(Some(false))))
        });
        FilterStates {
            measured: self.measured.keys().map(|name| (name.clone(), state(name))).collect(),
            components: statuses.collect(),
        }
    }

    /// Returns the newly believed value, or `None` if the sample is held back. A sample of an attribute without a
    /// filter is believed. Some of the held samples are reported in `answers`.
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
                if is_reported(state.held) {
                    answers.push(Answer::Filtered {
                        name: name.to_owned(),
                        value: number::to_json(value),
                        because: hold.word(),
                        held: state.held,
                        due: filter
                            .crossing_due(state)
                            .filter(|_| hold == attribute::Hold::Debounce)
                            .map(Duration::from_micros),
                    });
                }
                None
            }
        }
    }

    /// Returns `true` if the reported status is believed from now on. Some of the held reports are mentioned in
    /// `answers`.
    pub(crate) fn report(
        &self,
        states: &mut FilterStates,
        now: Duration,
        component: &str,
        status: Status,
        answers: &mut Vec<Answer>,
    ) -> bool {
        let name = local_name(component);
        let filter = self.components.get(name).unwrap_or(&self.default_component);
        let state = states.components.entry(name.to_owned()).or_default();
        let is_believed = filter.report(state, micros(now), status);
        if !is_believed && is_reported(state.held) {
            answers.push(Answer::Filtered {
                name: name.to_owned(),
                value: json!(status.word()),
                because: if status == Status::Failed { "confirm" } else { "heal" },
                held: state.held,
                due: filter.due(state).map(Duration::from_micros),
            });
        }
        is_believed
    }

    pub(crate) fn due(&self, states: &FilterStates) -> Option<Duration> {
        let measured =
            self.measured.iter().filter_map(|(name, filter)| filter.due(states.measured.get(name)?));
        let components = states.components.iter().filter_map(|(name, state)| {
            self.components.get(name).unwrap_or(&self.default_component).due(state)
        });
        measured.chain(components).min().map(Duration::from_micros)
    }

    /// Applies and returns the changes of belief that are due at `now` without a further report: first changes of
    /// attributes, then changes of components. Sensors that have become silent are reported in `answers`.
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
            let filter = self.components.get(name).unwrap_or(&self.default_component);
            let status = filter.elapse(state, now);
            accepted.extend(status.map(|status| Accepted::Status(name.clone(), status)));
        }
        accepted
    }
}

impl Accepted {
    pub(crate) fn report(&self) -> (&str, RobotReport) {
        match self {
            Self::Value(name, value) => (name, RobotReport::measured(value)),
            Self::Status(name, status) => (name, RobotReport::Component(*status)),
            Self::Unknown(name) => (name, RobotReport::Unmeasured),
        }
    }
}

impl FilterStates {
    pub(crate) fn to_record(&self) -> Value {
        let measured = self.measured.iter().map(|(name, state)| (name.clone(), state.to_record()));
        let components = self.components.iter().map(|(name, state)| (name.clone(), state.to_record()));
        json!([Value::Object(measured.collect()), Value::Object(components.collect())])
    }

    pub(crate) fn from_record(record: &Value) -> Option<Self> {
        let [measured, components] = record.as_array()?.as_slice() else { return None };
        let measured = measured.as_object()?.iter();
        let components = components.as_object()?.iter();
        Some(Self {
            measured: measured
                .map(|(name, state)| Some((name.clone(), AttributeState::from_record(state)?)))
                .collect::<Option<_>>()?,
            components: components
                .map(|(name, state)| Some((name.clone(), ComponentState::from_record(state)?)))
                .collect::<Option<_>>()?,
        })
    }
}

/// Returns the bounds that the designs of a knowledge base state for measured attributes. The key is the local name of
/// the attribute; the side is the one on which the design can be used.
fn stated_bounds(knowledge: &Knowledge) -> BTreeMap<String, Vec<(BigRational, Side)>> {
    let view = knowledge.view();
    let operator = |iri: &str| {
        let property = format!("{}qa_comparison_operator", tomasys::NS);
        let value = view.values(iri, &property).into_iter().next()?;
        value.as_literal().map(rules::Literal::lexical)
    };
    let kinds = view.attribute_types().into_iter();
    // For the MROS model, a design is unavailable if `measured OPERATOR estimation` holds.
    let ruled_out_sides: BTreeMap<String, Side> = kinds
        .filter_map(|kind| match operator(&kind.iri)?.as_str() {
            "<" | "<=" => Some((kind.name, Side::Least)),
            ">" | ">=" => Some((kind.name, Side::Most)),
            _ => None,
        })
        .collect();
    let mut bounds: BTreeMap<String, Vec<(BigRational, Side)>> = BTreeMap::new();
    for design in view.function_designs() {
        for requirement in design.requirements {
            let attribute_bounds = bounds.entry(requirement.attribute).or_default();
            attribute_bounds.extend(requirement.minimum.map(|minimum| (minimum, Side::Least)));
            attribute_bounds.extend(requirement.maximum.map(|maximum| (maximum, Side::Most)));
        }
        for (attribute, estimation) in design.estimations {
            if let Some(side) = ruled_out_sides.get(&attribute) {
                bounds.entry(attribute).or_default().push((estimation, *side));
            }
        }
    }
    bounds
}

/// Returns `true` for the first, tenth, hundredth … held report, to limit the number of answers.
fn is_reported(held: u64) -> bool {
    held > 0 && 10_u64.checked_pow(held.ilog10()) == Some(held)
}

#[cfg(test)]
mod tests;
