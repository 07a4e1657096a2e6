//! Settings of signals: the tables `[[signals]]` of `ros.toml`.

use std::cmp::Ordering;
use std::sync::Arc;
use std::time::Duration;

use metaplan::mapek::{ComponentTimes, FilterSettings, MeasuredSettings, Stale};
use serde::{Deserialize, Deserializer};
use serde_json::Value;

use crate::node::{PrimaryState, valid_name};
use crate::types::{FieldPath, Library, MessageType};
use crate::validated::validated;

/// Default of the least time between two reports of a field or a rate.
const REPORT_INTERVAL: Duration = Duration::from_millis(100);

/// Default of the period in which the messages of a topic are counted for its rate.
const SILENCE: Duration = Duration::from_secs(2);

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Signal {
    pub(crate) source: Source,
    pub(crate) target: Target,
    /// Least time between two reports of a field or a rate. Reports of silence, presence and states are not
    /// limited.
    pub(crate) every: Duration,
    filter: Filter,
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Source {
    State {
        node: String,
        state: PrimaryState,
    },
    Presence {
        node: String,
    },
    /// Field of the messages on a topic. A component fails if no message arrives for `period`; `None` for no such
    /// limit.
    Field {
        topic: String,
        kind: Arc<MessageType>,
        field: FieldPath,
        period: Option<Duration>,
    },
    /// Messages per second on a topic, within the last `period`.
    Rate {
        topic: String,
        period: Duration,
    },
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Target {
    /// The component works while the condition holds.
    Component { component: String, condition: Condition },
    /// The attribute is the value times `scale` plus `offset`.
    Attribute { attribute: String, scale: f64, offset: f64 },
}

/// Condition on a value. The empty condition holds for every value.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Condition {
    at_least: Option<f64>,
    at_most: Option<f64>,
    equals: Option<Value>,
}

impl Condition {
    /// Returns `true` if a value meets the condition. A value that is not a number meets no bound.
    pub(crate) fn holds(&self, value: &Value) -> bool {
        let number = number(value);
        let meets = |bound: Option<f64>, is_met: fn(f64, f64) -> bool| {
            bound.is_none_or(|bound| number.is_some_and(|number| is_met(number, bound)))
        };
        let is_equal = self.equals.as_ref().is_none_or(|equal| match (self::number(equal), number) {
            (Some(equal), Some(number)) => equal.partial_cmp(&number) == Some(Ordering::Equal),
            _ => equal == value,
        });
        is_equal
            && meets(self.at_least, |number, bound| number >= bound)
            && meets(self.at_most, |number, bound| number <= bound)
    }
}

/// Converts a JSON value to a number. Truth values become 0 and 1. Returns `None` for other values.
pub(crate) fn number(value: &Value) -> Option<f64> {
    match value {
        Value::Bool(truth) => Some(f64::from(u8::from(*truth))),
        _ => value.as_f64().filter(|number| number.is_finite()),
    }
}

#[derive(Debug, Clone, Default, PartialEq)]
struct Filter {
    period: Option<Duration>,
    stale: Option<StaleWord>,
    hysteresis: Option<f64>,
    debounce: Option<Duration>,
    confirm_time: Option<Duration>,
    heal_time: Option<Duration>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
enum StaleWord {
    Worst,
    Keep,
    Unknown,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    node: Option<String>,
    state: Option<PrimaryState>,
    topic: Option<String>,
    r#type: Option<String>,
    field: Option<String>,
    component: Option<String>,
    at_least: Option<f64>,
    at_most: Option<f64>,
    equals: Option<Value>,
    attribute: Option<String>,
    scale: Option<f64>,
    offset: Option<f64>,
    every: Option<f64>,
    period: Option<f64>,
    stale: Option<StaleWord>,
    hysteresis: Option<f64>,
    debounce: Option<f64>,
    confirm_time: Option<f64>,
    heal_time: Option<f64>,
}

impl<'de> Deserialize<'de> for Signal {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        validated::<Entry, _, _>(deserializer)
    }
}

impl TryFrom<Entry> for Signal {
    type Error = String;

    fn try_from(entry: Entry) -> Result<Self, Self::Error> {
        let numbers = [entry.at_least, entry.at_most, entry.scale, entry.offset];
        if numbers.into_iter().flatten().any(|number| !number.is_finite()) {
            return Err("`at_least`, `at_most`, `scale` and `offset` must be finite numbers".to_owned());
        }
        let seconds = |name: &str, value: Option<f64>| {
            let convert = |value| {
                Duration::try_from_secs_f64(value)
                    .map_err(|_| format!("`{name}` must be a number of seconds, 0 or more"))
            };
            value.map(convert).transpose()
        };
        let period = seconds("period", entry.period)?;
        if period.is_some_and(|period| period.is_zero()) {
            return Err("`period` must be greater than 0".to_owned());
        }
        let source = source(&entry, period)?;
        let target = target(&entry, &source)?;
        if entry.hysteresis.is_some_and(|width| !(0.0..f64::INFINITY).contains(&width)) {
            return Err("`hysteresis` must be 0 or more".to_owned());
        }
        let is_attribute = matches!(target, Target::Attribute { .. });
        let filter = Filter {
            period: period.filter(|_| is_attribute),
            stale: entry.stale,
            hysteresis: entry.hysteresis,
            debounce: seconds("debounce", entry.debounce)?,
            confirm_time: seconds("confirm_time", entry.confirm_time)?,
            heal_time: seconds("heal_time", entry.heal_time)?,
        };
        let of_attribute = filter.stale.is_some() || filter.hysteresis.is_some() || filter.debounce.is_some();
        if !is_attribute && of_attribute {
            return Err("`stale`, `hysteresis` and `debounce` belong to an `attribute`".to_owned());
        }
        if is_attribute && (filter.confirm_time.is_some() || filter.heal_time.is_some()) {
            return Err("`confirm_time` and `heal_time` belong to a `component`".to_owned());
        }
        if filter.stale.is_some() && filter.period.is_none() {
            return Err("`stale` needs the `period` after which the topic is silent".to_owned());
        }
        let every = seconds("every", entry.every)?.unwrap_or(REPORT_INTERVAL);
        Ok(Self { source, target, every, filter })
    }
}

fn source(entry: &Entry, period: Option<Duration>) -> Result<Source, String> {
    match (&entry.node, &entry.topic) {
        (Some(node), None) => {
            if entry.r#type.is_some() || entry.field.is_some() || period.is_some() || entry.every.is_some() {
                return Err("`type`, `field`, `period` and `every` belong to a `topic`".to_owned());
            }
            let node = valid_name("node", node)?;
            Ok(match entry.state {
                Some(state) => Source::State { node, state },
                None => Source::Presence { node },
            })
        }
        (None, Some(topic)) => {
            if entry.state.is_some() {
                return Err("`state` belongs to a `node`".to_owned());
            }
            let topic = valid_name("topic", topic)?;
            match (&entry.r#type, &entry.field) {
                (None, None) => Ok(Source::Rate { topic, period: period.unwrap_or(SILENCE) }),
                (Some(kind), Some(field)) => {
                    let field = FieldPath::parse(field)?;
                    let kind = Library::current().message(kind).map_err(|error| {
                        format!("{error}. Without `type` and `field`, the signal is the rate of the topic")
                    })?;
                    field.is_text(&kind.structure)?;
                    Ok(Source::Field { topic, kind: Arc::new(kind), field, period })
                }
                _ => Err(
                    "`type` and `field` belong together; without both the signal is the rate of the topic"
                        .to_owned(),
                ),
            }
        }
        _ => Err("a signal needs either a `node` or a `topic`".to_owned()),
    }
}

fn target(entry: &Entry, source: &Source) -> Result<Target, String> {
    let condition =
        Condition { at_least: entry.at_least, at_most: entry.at_most, equals: entry.equals.clone() };
    let is_conditional = condition != Condition::default();
    let of_node = matches!(source, Source::State { .. } | Source::Presence { .. });
    match (&entry.component, &entry.attribute) {
        (Some(component), None) => {
            if entry.scale.is_some() || entry.offset.is_some() {
                return Err("`scale` and `offset` belong to an `attribute`".to_owned());
            }
            if of_node && is_conditional {
                return Err("`at_least`, `at_most` and `equals` belong to a `topic`".to_owned());
            }
            if matches!(source, Source::Field { period: None, .. }) && !is_conditional {
                return Err(
                    "the component works always: give `at_least`, `at_most`, `equals` or `period`".to_owned()
                );
            }
            if condition
                .equals
                .as_ref()
                .is_some_and(|value| value.is_object() || value.is_array() || value.is_null())
            {
                return Err("`equals` must be a number, a text or a truth value".to_owned());
            }
            Ok(Target::Component { component: component.clone(), condition })
        }
        (None, Some(_)) if of_node => Err("a node has no number: it reports a `component`".to_owned()),
        (None, Some(_)) if is_conditional => {
            Err("`at_least`, `at_most` and `equals` belong to a `component`".to_owned())
        }
        (None, Some(attribute)) => {
            if let Source::Field { kind, field, .. } = source
                && field.is_text(&kind.structure)?
            {
                return Err("the field is a text, which cannot be the value of an attribute".to_owned());
            }
            Ok(Target::Attribute {
                attribute: attribute.clone(),
                scale: entry.scale.unwrap_or(1.0),
                offset: entry.offset.unwrap_or(0.0),
            })
        }
        (Some(_), Some(_)) | (None, None) => {
            Err("name either a `component` or an `attribute` of the knowledge base".to_owned())
        }
    }
}

impl Signal {
    /// Returns the component or the attribute that the signal concerns. The other part of the pair is `None`.
    pub(crate) fn target(&self) -> (Option<&str>, Option<&str>) {
        match &self.target {
            Target::Component { component, .. } => (Some(component), None),
            Target::Attribute { attribute, .. } => (None, Some(attribute)),
        }
    }

    /// Adds the filter of this signal to those of the loop. Of the filter in the manifest, only the values
    /// that the signal gives are replaced.
    pub(crate) fn add_filter(&self, filters: &mut FilterSettings) {
        let Filter { period, stale, hysteresis, debounce, confirm_time, heal_time } = &self.filter;
        match &self.target {
            Target::Attribute { attribute, .. } => {
                if self.filter == Filter::default() {
                    return;
                }
                let measured: &mut MeasuredSettings = filters.measured.entry(attribute.clone()).or_default();
                measured.period = period.or(measured.period);
                measured.debounce = debounce.unwrap_or(measured.debounce);
                if let Some(stale) = stale {
                    measured.stale = match stale {
                        StaleWord::Worst => Stale::Worst,
                        StaleWord::Keep => Stale::Keep,
                        StaleWord::Unknown => Stale::Unknown,
                    };
                }
                if let Some(width) = hysteresis {
                    measured.hysteresis = decimal_fraction(*width).parse().ok();
                }
            }
            Target::Component { component, .. } => {
                if confirm_time.is_none() && heal_time.is_none() {
                    return;
                }
                let times: &mut ComponentTimes = filters.components.entry(component.clone()).or_default();
                times.confirm_time = confirm_time.or(times.confirm_time);
                times.heal_time = heal_time.or(times.heal_time);
            }
        }
    }
}

/// Formats a number as an exact fraction of integers, so that 0.05 is 5/100 and not the nearest binary
/// number.
fn decimal_fraction(number: f64) -> String {
    let text = number.to_string();
    let (whole, decimals) = text.split_once('.').unwrap_or((&text, ""));
    format!("{whole}{decimals}/1{}", "0".repeat(decimals.len()))
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use metaplan::mapek::FilterSettings;
    use serde_json::json;

    use super::{Condition, Signal, Source, Target, decimal_fraction};

    fn read(text: &str) -> Result<Signal, String> {
        toml::from_str(text).map_err(|error| error.message().to_owned())
    }

    #[test]
    fn all_sources_are_read() {
        let source = |text: &str| read(text).expect(text).source;
        assert!(matches!(
            source("node = \"/a\"\nstate = \"active\"\ncomponent = \"c\""),
            Source::State { .. }
        ));
        assert!(matches!(source("node = \"/a\"\ncomponent = \"c\""), Source::Presence { .. }));
        let rate = source("topic = \"/scan\"\ncomponent = \"c\"\nat_least = 5");
        assert_eq!(rate, Source::Rate { topic: "/scan".to_owned(), period: Duration::from_secs(2) });
        let battery = read(
            "topic = \"/battery\"\ntype = \"sensor_msgs/msg/BatteryState\"\nfield = \"percentage\"\nattribute = \"charge\"\nscale = 100",
        )
        .expect("a signal");
        assert!(matches!(battery.source, Source::Field { period: None, .. }));
        assert_eq!(
            battery.target,
            Target::Attribute { attribute: "charge".to_owned(), scale: 100.0, offset: 0.0 }
        );
    }

    #[test]
    fn inconsistent_signals_are_rejected() {
        let field = "topic = \"/t\"\ntype = \"std_msgs/msg/Float64\"\nfield = \"data\"\n";
        for (text, part) in [
            ("component = \"c\"".to_owned(), "either a `node` or a `topic`"),
            ("node = \"/a\"".to_owned(), "either a `component` or an `attribute`"),
            ("node = \"/a\"\nattribute = \"q\"".to_owned(), "has no number"),
            ("node = \"/a\"\ncomponent = \"c\"\nat_least = 1".to_owned(), "belong to a `topic`"),
            ("node = \"/a b\"\ncomponent = \"c\"".to_owned(), "not a valid name of a node"),
            (format!("{field}component = \"c\""), "works always"),
            (format!("{field}attribute = \"q\"\nequals = 1"), "belong to a `component`"),
            (format!("{field}attribute = \"q\"\nstale = \"keep\""), "needs the `period`"),
            (format!("{field}attribute = \"q\"\nheal_time = 1"), "belong to a `component`"),
            (format!("{field}attribute = \"q\"\nscale = nan"), "finite"),
            (format!("{field}component = \"c\"\nequals = []"), "a number, a text or a truth value"),
            (field.replace("data", "date") + "attribute = \"q\"", "did you mean `data`?"),
            (
                field.replace("Float64", "Float46") + "attribute = \"q\"",
                "did you mean `std_msgs/msg/Float64`?",
            ),
            (field.replace("Float64", "String") + "attribute = \"q\"", "is a text"),
            ("topic = \"/t\"\ntype = \"std_msgs/msg/Bool\"\ncomponent = \"c\"".to_owned(), "belong together"),
            ("topic = \"/t\"\nattribute = \"q\"\nperiod = 0".to_owned(), "greater than 0"),
        ] {
            let message = read(&text).expect_err(&text);
            assert!(message.contains(part), "{text}: {message}");
        }
    }

    #[test]
    fn conditions_are_about_numbers_texts_and_truth_values() {
        let between = Condition { at_least: Some(1.0), at_most: Some(2.0), equals: None };
        assert!(between.holds(&json!(1)) && between.holds(&json!(2.0)) && !between.holds(&json!(2.5)));
        assert!(!between.holds(&json!(null)), "a missing number meets no bound");
        let equal = |value| Condition { equals: Some(value), ..Condition::default() };
        assert!(equal(json!(1)).holds(&json!(1.0)) && equal(json!(true)).holds(&json!(true)));
        assert!(equal(json!("on")).holds(&json!("on")) && !equal(json!("on")).holds(&json!("off")));
        assert!(Condition::default().holds(&json!(null)));
    }

    #[test]
    fn filters_are_those_of_the_loop() {
        let mut filters = FilterSettings::default();
        let signal = read(
            "topic = \"/t\"\nattribute = \"q\"\nperiod = 1.5\nstale = \"keep\"\nhysteresis = 0.05\ndebounce = 0.5",
        );
        signal.expect("a signal").add_filter(&mut filters);
        let measured = &filters.measured["q"];
        assert_eq!(
            (measured.period, measured.debounce),
            (Some(Duration::from_millis(1500)), Duration::from_millis(500))
        );
        assert_eq!(measured.hysteresis.as_ref().map(ToString::to_string).as_deref(), Some("1/20"));
        read("node = \"/a\"\ncomponent = \"c\"\nheal_time = 0").expect("a signal").add_filter(&mut filters);
        assert_eq!(filters.components["c"].heal_time, Some(Duration::ZERO));
        assert_eq!(decimal_fraction(12.0), "12/1");
    }
}
