//! Rules of `ros.toml` that translate a robot's own diagnostics into statuses of components and measurements
//! of attributes.
//!
//! A driver publishes `diagnostic_msgs/DiagnosticStatus` with a level and a text of its own. A rule selects such
//! statuses by patterns. It names the component whose status follows from the level, or the attribute whose value is in
//! one of the key/value pairs.

use serde::{Deserialize, Deserializer};

use crate::interfaces::diagnostic_msgs::msg::{DiagnosticStatus, KeyValue};
use crate::validated::validated;

/// Message of a status that measures attributes, in the spelling of MROS.
pub(crate) const MEASUREMENT: &str = "QA status";

/// Message of a status that reports components, in the spelling of MROS.
pub(crate) const COMPONENT: &str = "Component status";

/// Value of a component that works, in the spelling of MROS.
pub(crate) const WORKING: &str = "TRUE";

/// Value of a component that has failed, in the spelling of MROS.
pub(crate) const FAILED: &str = "FALSE";

#[derive(Debug, Clone, PartialEq)]
pub struct DiagnosticRule {
    name: Pattern,
    hardware_id: Pattern,
    message: Pattern,
    target: Target,
}

#[derive(Debug, Clone, PartialEq)]
enum Target {
    /// A component, which has failed at the level `fails_at` and above, and works below it.
    Component { component: String, fails_at: Level },
    /// An attribute, whose value is the number of the pair with the key `key`, converted to another unit if
    /// there is a conversion.
    Attribute { attribute: String, key: String, conversion: Option<Conversion> },
}

/// A linear conversion of units: number · scale + offset.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Conversion {
    scale: f64,
    offset: f64,
}

/// Level of a diagnostic status. STALE counts as the highest level, because the state of the device
/// is then unknown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "UPPERCASE")]
enum Level {
    Warn = DiagnosticStatus::WARN as isize,
    #[default]
    Error = DiagnosticStatus::ERROR as isize,
    Stale = DiagnosticStatus::STALE as isize,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    #[serde(default)]
    name: Pattern,
    #[serde(default)]
    hardware_id: Pattern,
    #[serde(default)]
    message: Pattern,
    component: Option<String>,
    fails_at: Option<Level>,
    attribute: Option<String>,
    key: Option<String>,
    scale: Option<f64>,
    offset: Option<f64>,
}

impl<'de> Deserialize<'de> for DiagnosticRule {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        validated::<Entry, _, _>(deserializer)
    }
}

impl TryFrom<Entry> for DiagnosticRule {
    type Error = &'static str;

    fn try_from(entry: Entry) -> Result<Self, Self::Error> {
        let Entry { name, hardware_id, message, component, fails_at, attribute, key, scale, offset } = entry;
        if [&name, &hardware_id, &message].into_iter().all(|pattern| *pattern == Pattern::default()) {
            return Err("selects every status: give a pattern for `name`, `hardware_id` or `message`");
        }
        let is_number = [scale, offset].into_iter().flatten().all(f64::is_finite);
        let target = match (component, attribute) {
            (Some(component), None) if key.is_none() && scale.is_none() && offset.is_none() => {
                Target::Component { component, fails_at: fails_at.unwrap_or_default() }
            }
            (Some(_), None) => return Err("`key`, `scale` and `offset` belong to an `attribute`"),
            (None, Some(_)) if fails_at.is_some() => return Err("`fails_at` belongs to a `component`"),
            (None, Some(_)) if !is_number => return Err("`scale` and `offset` must be finite numbers"),
            (None, Some(attribute)) => Target::Attribute {
                attribute,
                key: key.ok_or("an `attribute` needs the `key` of the pair that has its value")?,
                conversion: (scale.is_some() || offset.is_some())
                    .then(|| Conversion { scale: scale.unwrap_or(1.0), offset: offset.unwrap_or(0.0) }),
            },
            (Some(_), Some(_)) | (None, None) => {
                return Err("name either a `component` or an `attribute` of the knowledge base");
            }
        };
        Ok(Self { name, hardware_id, message, target })
    }
}

impl DiagnosticRule {
    /// Returns the component or the attribute that the rule concerns; the other part of the pair is `None`.
    pub(crate) fn target(&self) -> (Option<&str>, Option<&str>) {
        match &self.target {
            Target::Component { component, .. } => (Some(component), None),
            Target::Attribute { attribute, .. } => (None, Some(attribute)),
        }
    }

    /// Translates a status. Returns `None` if the rule does not select the status, or if the number of an
    /// attribute is missing.
    pub(crate) fn translate(&self, status: &DiagnosticStatus) -> Option<DiagnosticStatus> {
        let is_selected = self.name.matches(&status.name)
            && self.hardware_id.matches(&status.hardware_id)
            && self.message.matches(&status.message);
        if !is_selected {
            return None;
        }
        let (message, key, value) = match &self.target {
            Target::Component { component, fails_at } => {
                let value = if status.level >= *fails_at as u8 { FAILED } else { WORKING };
                (COMPONENT, component, value.to_owned())
            }
            Target::Attribute { attribute, key, conversion } => {
                let text = status.values.iter().find(|pair| pair.key == *key)?.value.trim();
                let number = leading_number(text)?;
                let value = match conversion {
                    Some(Conversion { scale, offset }) => (number * scale + offset).to_string(),
                    // The digits are copied unchanged, because a float would round them.
                    None if text.parse::<f64>().is_ok() => text.to_owned(),
                    None => number.to_string(),
                };
                (MEASUREMENT, attribute, value)
            }
        };
        Some(DiagnosticStatus {
            message: message.to_owned(),
            values: vec![KeyValue { key: key.clone(), value }],
            ..status.clone()
        })
    }
}

fn leading_number(text: &str) -> Option<f64> {
    let text = text.trim_start();
    let end = text.find(|character: char| !matches!(character, '0'..='9' | '+' | '-' | '.' | 'e' | 'E'));
    let number = text.get(..end.unwrap_or(text.len()))?;
    // The unit may begin with an `e`.
    let number = number.parse().or_else(|_| number.trim_end_matches(['e', 'E', '+', '-', '.']).parse());
    number.ok().filter(|number: &f64| number.is_finite())
}

/// A pattern in which `*` matches any number of characters. The default matches everything.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(transparent)]
struct Pattern(String);

impl Default for Pattern {
    fn default() -> Self {
        Self("*".to_owned())
    }
}

impl Pattern {
    fn matches(&self, text: &str) -> bool {
        let mut parts = self.0.split('*');
        let first = parts.next().unwrap_or_default();
        let Some(mut remaining) = text.strip_prefix(first) else { return false };
        let mut parts: Vec<&str> = parts.collect();
        // Without a star the whole text must be equal.
        let Some(last) = parts.pop() else { return remaining.is_empty() };
        for part in parts {
            let Some(at) = remaining.find(part) else { return false };
            remaining = &remaining[at + part.len()..];
        }
        remaining.ends_with(last)
    }
}

#[cfg(test)]
mod tests {
    use super::{
        COMPONENT, DiagnosticRule, DiagnosticStatus, KeyValue, MEASUREMENT, Pattern, leading_number,
    };

    fn rule(text: &str) -> Result<DiagnosticRule, String> {
        toml::from_str(text).map_err(|error| error.message().to_owned())
    }

    fn status(level: u8, name: &str, pairs: &[(&str, &str)]) -> DiagnosticStatus {
        let pair =
            |(key, value): &(&str, &str)| KeyValue { key: (*key).to_owned(), value: (*value).to_owned() };
        DiagnosticStatus {
            level,
            name: name.to_owned(),
            message: "No frames received".to_owned(),
            hardware_id: "usb-1".to_owned(),
            values: pairs.iter().map(pair).collect(),
        }
    }

    #[test]
    fn patterns_match_whole_texts() {
        let check = |pattern: &str, text: &str, expected: bool| {
            assert_eq!(Pattern(pattern.to_owned()).matches(text), expected, "{pattern} {text}");
        };
        check("a", "a", true);
        check("a", "ab", false);
        check("", "a", false);
        check("*", "", true);
        check("a*c", "abc", true);
        check("a*c", "ab", false);
        check("ab*b", "ab", false);
        check("*driver*", "kinect: camera driver", true);
        check("a*b*b", "ab", false);
        check("k*: *r", "kinect: camera driver", true);
    }

    #[test]
    fn the_level_of_a_driver_is_the_status_of_a_component() {
        let rule = rule("name = \"kinect: *\"\ncomponent = \"c_kinect\"").expect("a rule");
        for (level, expected) in [(0, "TRUE"), (1, "TRUE"), (2, "FALSE"), (3, "FALSE")] {
            let status = rule.translate(&status(level, "kinect: camera driver", &[])).expect("selected");
            assert_eq!((status.message.as_str(), status.values[0].key.as_str()), (COMPONENT, "c_kinect"));
            assert_eq!(status.values[0].value, expected, "{level}");
        }
        assert_eq!(rule.translate(&status(2, "lidar: driver", &[])), None);
        let strict =
            super::tests::rule("name = \"*\"\nmessage = \"No*\"\ncomponent = \"c\"\nfails_at = \"WARN\"");
        let status = strict.expect("a rule").translate(&status(1, "x", &[])).expect("selected");
        assert_eq!(status.values[0].value, "FALSE");
    }

    #[test]
    fn a_number_under_a_key_is_the_value_of_an_attribute() {
        let rule = rule("hardware_id = \"usb-*\"\nattribute = \"battery\"\nkey = \"Charge\"\nscale = 0.01");
        let rule = rule.expect("a rule");
        let measured = |text: &str| {
            let status = rule.translate(&status(0, "battery", &[("Voltage", "12"), ("Charge", text)]))?;
            assert_eq!((status.message.as_str(), status.values[0].key.as_str()), (MEASUREMENT, "battery"));
            Some(status.values[0].value.clone())
        };
        assert_eq!(measured("50 %").as_deref(), Some("0.5"));
        assert_eq!(measured("unknown"), None);
        assert_eq!(measured("nan"), None);
        assert_eq!(leading_number("12.4 V"), Some(12.4));
        assert_eq!(leading_number("-3e2"), Some(-300.0));
        assert_eq!(leading_number("4 eggs"), Some(4.0));
        assert_eq!(leading_number("4e"), Some(4.0));
    }

    #[test]
    fn inconsistent_rules_are_rejected() {
        for (text, part) in [
            ("component = \"c\"", "selects every status"),
            ("name = \"a\"", "either"),
            ("name = \"a\"\ncomponent = \"c\"\nattribute = \"q\"", "either"),
            ("name = \"a\"\nattribute = \"q\"", "`key`"),
            ("name = \"a\"\nattribute = \"q\"\nkey = \"k\"\nfails_at = \"WARN\"", "`fails_at`"),
            ("name = \"a\"\ncomponent = \"c\"\nscale = 2.0", "`scale`"),
            ("name = \"a\"\nattribute = \"q\"\nkey = \"k\"\nscale = inf", "finite"),
        ] {
            let message = rule(text).expect_err(text);
            assert!(message.contains(part), "{text}: {message}");
        }
    }
}
