//! The settings of all filters, as a mission states them.

use std::collections::BTreeMap;
use std::time::Duration;

use num_rational::BigRational;

use crate::knowledge::Knowledge;
use crate::mapek::filter::attribute::{AttributeFilter, Bound, Micros, Stale};
use crate::message::{Message, did_you_mean};

/// Default share of a bound that its band takes: the repeatability of ordinary sensors is 1 to 2 % of the reading.
const BAND: (i64, i64) = (1, 50);

/// Default time for which a component must be in order again. Drivers publish diagnostics once a second, so that two
/// reports in a row say so.
const HEAL: Duration = Duration::from_secs(2);

/// What is filtered, as the mission says.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct FilterSettings {
    /// Time for which a failure of a component must be reported before it is believed; 0 unless said otherwise.
    pub confirm_time: Duration,
    /// Time for which a recovery of a component must be reported before it is believed; 2 seconds unless said otherwise.
    pub heal_time: Duration,
    /// Share of a bound that its band takes where no hysteresis is set; 0.02 unless said otherwise.
    pub band: BigRational,
    /// Times of single components, by local name.
    pub components: BTreeMap<String, ComponentTimes>,
    /// Filters of single attributes, by local name.
    pub measured: BTreeMap<String, MeasuredSettings>,
}

/// Times of a component; those of all components where none is set.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ComponentTimes {
    /// Time for which a failure must be reported before it is believed.
    pub confirm_time: Option<Duration>,
    /// Time for which a recovery must be reported before it is believed.
    pub heal_time: Option<Duration>,
}

/// Filter of a measured attribute. The default has the bands of the knowledge base and nothing else.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct MeasuredSettings {
    /// Band at each bound, in the attribute's unit; a share of the bound where none is set.
    pub hysteresis: Option<BigRational>,
    /// Bounds that the designs of the knowledge base do not state, such as those in rules.
    pub bounds: Vec<BigRational>,
    /// Number of the last `of` samples that must have crossed a bound; 0 for no such condition.
    pub agree: usize,
    /// Number of samples of which `agree` must have crossed.
    pub of: usize,
    /// Time for which all samples must have crossed a bound.
    pub debounce: Duration,
    /// Least plausible value.
    pub minimum: Option<BigRational>,
    /// Greatest plausible value.
    pub maximum: Option<BigRational>,
    /// Greatest plausible distance from one sample to the next.
    pub jump: Option<BigRational>,
    /// Time without a plausible sample after which the sensor is silent; never where none is set.
    pub period: Option<Duration>,
    /// Outcome for a silent sensor.
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
    /// No filter: every report is believed at once.
    pub fn none() -> Self {
        Self { heal_time: Duration::ZERO, band: BigRational::default(), ..Self::default() }
    }

    /// Names that the knowledge base does not have, each as an error with the key below `adaptation` that has it.
    pub(crate) fn mistakes(&self, knowledge: Option<&Knowledge>) -> Vec<(&'static str, String, Message)> {
        let view = knowledge.map(Knowledge::view);
        let attributes: Vec<String> =
            view.iter().flat_map(ontology::tomasys::View::attribute_types).map(|own| own.name).collect();
        let components: Vec<String> = view
            .iter()
            .flat_map(ontology::tomasys::View::components)
            .map(|own| own.individual.name)
            .collect();
        let unknown = |key: &'static str, kind: &str, name: &String, known: &[String]| {
            let meant = did_you_mean(name, known.iter().map(String::as_str));
            let text =
                format!("the knowledge base has no {kind} `{name}`; it has: {}{meant}", known.join(", "));
            (!known.contains(name)).then(|| (key, name.clone(), Message::error("M143", text)))
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

/// Microseconds of a duration.
pub(super) fn micros(time: Duration) -> Micros {
    u64::try_from(time.as_micros()).unwrap_or(u64::MAX)
}
