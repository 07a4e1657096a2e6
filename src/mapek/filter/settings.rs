//! Settings of a mission's noise filters for measurements and component reports.

use std::collections::BTreeMap;
use std::time::Duration;

use num_rational::BigRational;

use crate::knowledge::Knowledge;
use crate::mapek::filter::attribute::{AttributeFilter, Bound, Micros, Stale};
use crate::message::{Message, did_you_mean};

/// Default hysteresis as a share of the bound (numerator, denominator). The repeatability of ordinary sensors is 1 to 2
/// % of the reading.
const BAND: (i64, i64) = (1, 50);

/// Default of [`FilterSettings::heal_time`]. A driver that publishes diagnostics once a second sends two reports in
/// this time.
const HEAL: Duration = Duration::from_secs(2);

/// Settings of the filters for measurements and component reports.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct FilterSettings {
    /// Time without a contrary report after which a reported failure of a component is believed. Default: 0.
    pub confirm_time: Duration,
    /// Time without a report of a failure after which a reported recovery of a component is believed. Default: 2 s.
    pub heal_time: Duration,
    /// Hysteresis as a share of the bound, for attributes without their own hysteresis. Default: 0.02.
    pub band: BigRational,
    /// Confirmation times of single components, by local name.
    pub components: BTreeMap<String, ComponentTimes>,
    /// Filters of single attributes, by local name.
    pub measured: BTreeMap<String, MeasuredSettings>,
}

/// Confirmation times of one component. Missing times default to the times in [`FilterSettings`].
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ComponentTimes {
    /// Time without a contrary report after which a reported failure is believed.
    pub confirm_time: Option<Duration>,
    /// Time without a report of a failure after which a reported recovery is believed.
    pub heal_time: Option<Duration>,
}

/// Filter of one measured attribute. By default, the filter only applies a hysteresis at the bounds of the knowledge
/// base.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct MeasuredSettings {
    /// Hysteresis: distance from a violated bound at which the bound counts as satisfied again, in the attribute's
    /// unit. Default: a share of the bound.
    pub hysteresis: Option<BigRational>,
    /// Additional values that designs need at least, such as bounds in rules. The bounds of designs in the knowledge
    /// base are included automatically.
    pub lower_bounds: Vec<BigRational>,
    /// Additional values that designs need at most.
    pub upper_bounds: Vec<BigRational>,
    /// Additional bounds on both sides of which designs are lost. In both directions, only a sample at the distance of
    /// the hysteresis counts.
    pub bounds: Vec<BigRational>,
    /// Number of the last `of` samples that must have crossed a bound; 0 and 1 disable the condition.
    pub agree: usize,
    /// Number of latest samples that `agree` considers.
    pub of: usize,
    /// Time for which all samples must have crossed a bound before the crossing is believed.
    pub debounce: Duration,
    /// Least plausible value.
    pub minimum: Option<BigRational>,
    /// Greatest plausible value.
    pub maximum: Option<BigRational>,
    /// Greatest plausible distance from the last plausible sample.
    pub jump: Option<BigRational>,
    /// Time without a plausible sample after which the sensor is silent; `None` for never.
    pub period: Option<Duration>,
    /// Value that is believed while the sensor is silent.
    pub stale: Stale,
}

impl Default for FilterSettings {
    fn default() -> Self {
        Self {
            confirm_time: Duration::ZERO,
            heal_time: HEAL,
            band: BigRational::new(BAND.0.into(), BAND.1.into()),
            components: BTreeMap::new(),
            measured: BTreeMap::new(),
        }
    }
}

impl FilterSettings {
    /// Settings without filters: every report is believed at once.
    pub fn none() -> Self {
        Self { heal_time: Duration::ZERO, band: BigRational::default(), ..Self::default() }
    }

    /// Returns the configured attributes and components that the knowledge base does not have (without a knowledge
    /// base, all). For each one, returns the key in the section `adaptation` (`measured` or `components`), the unknown
    /// name, and an error.
    pub(crate) fn mistakes(&self, knowledge: Option<&Knowledge>) -> Vec<(&'static str, String, Message)> {
        let view = knowledge.map(Knowledge::view);
        let attributes: Vec<String> = view
            .iter()
            .flat_map(ontology::tomasys::View::attribute_types)
            .map(|element| element.name)
            .collect();
        let components: Vec<String> = view
            .iter()
            .flat_map(ontology::tomasys::View::components)
            .map(|element| element.individual.name)
            .collect();
        let unknown = |key: &'static str, kind: &str, name: &String, names: &[String]| {
            let suggestion = did_you_mean(name, names.iter().map(String::as_str));
            let text = format!(
                "the knowledge base has no {kind} `{name}`; it has: {}{suggestion}",
                names.join(", ")
            );
            (!names.contains(name)).then(|| (key, name.clone(), Message::error("M143", text)))
        };
        let measured = self
            .measured
            .keys()
            .filter_map(|name| unknown("measured", "quality attribute type", name, &attributes));
        let parts =
            self.components.keys().filter_map(|name| unknown("components", "component", name, &components));
        measured.chain(parts).collect()
    }
}

impl MeasuredSettings {
    pub(super) fn filter(&self, bounds: Vec<Bound>) -> AttributeFilter {
        AttributeFilter {
            bounds,
            agree: self.agree,
            of: self.of,
            debounce: micros(self.debounce),
            minimum: self.minimum.clone(),
            maximum: self.maximum.clone(),
            jump: self.jump.clone(),
            period: self.period.map(micros),
            stale: self.stale,
        }
    }
}

pub(super) fn micros(time: Duration) -> Micros {
    u64::try_from(time.as_micros()).unwrap_or(u64::MAX)
}
