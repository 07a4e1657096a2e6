//! Keys of the section `adaptation` that configure filters.

use std::collections::BTreeMap;
use std::time::Duration;

use num_rational::BigRational;
use schemars::JsonSchema;
use serde::Deserialize;
use toml::Spanned;

use crate::manifest::{self, ManifestPath};
use crate::mapek::filter::attribute::Stale;
use crate::mapek::filter::settings::{ComponentTimes, FilterSettings, MeasuredSettings};
use crate::message::Message;
use crate::number;

type Number = Option<Spanned<toml::Value>>;

pub(crate) type ComponentsSection = BTreeMap<String, ComponentSection>;

pub(crate) type MeasuredsSection = BTreeMap<String, MeasuredSection>;

/// The section `adaptation.components.NAME` of a manifest.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ComponentSection {
    /// Seconds without a contrary report after which a reported failure of this component takes effect. Default:
    /// `adaptation.confirm_time`.
    #[serde(default)]
    #[schemars(schema_with = "manifest::decimal")]
    confirm_time: Number,
    /// Seconds without a report of a failure, counted from the first report that this component works, after which it
    /// counts as recovered. Default: `adaptation.heal_time`.
    #[serde(default)]
    #[schemars(schema_with = "manifest::decimal")]
    heal_time: Number,
}

/// The section `adaptation.measured.NAME` of a manifest.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MeasuredSection {
    /// Hysteresis: distance from a violated bound at which it counts as satisfied again, in the attribute's unit
    /// (default: the share `adaptation.band` of the bound; 0 for none).
    #[serde(default)]
    #[schemars(schema_with = "manifest::decimal")]
    hysteresis: Number,
    /// Additional values that designs need at least, such as those in rules. The bounds of designs in the
    /// knowledge base are included automatically.
    #[serde(default)]
    #[schemars(with = "Vec<f64>")]
    lower_bounds: Vec<Spanned<toml::Value>>,
    /// Additional values that designs need at most, such as those in rules. The bounds of designs in the
    /// knowledge base are included automatically.
    #[serde(default)]
    #[schemars(with = "Vec<f64>")]
    upper_bounds: Vec<Spanned<toml::Value>>,
    /// Additional bounds on both sides of which designs are lost. In both directions, only a sample at the
    /// distance `hysteresis` counts. For designs that are lost on one side, use `lower_bounds` or `upper_bounds`.
    #[serde(default)]
    #[schemars(with = "Vec<f64>")]
    bounds: Vec<Spanned<toml::Value>>,
    /// Number of the last `of` samples that must have crossed a bound before the crossing takes effect.
    #[serde(default)]
    agree: usize,
    /// Number of samples considered by `agree`.
    #[serde(default)]
    of: usize,
    /// Seconds for which all samples must have crossed a bound before the crossing takes effect.
    #[serde(default)]
    #[schemars(schema_with = "manifest::decimal")]
    debounce: Number,
    /// Minimum plausible value; lower samples are ignored.
    #[serde(default)]
    #[schemars(with = "Option<f64>")]
    minimum: Number,
    /// Maximum plausible value; higher samples are ignored.
    #[serde(default)]
    #[schemars(with = "Option<f64>")]
    maximum: Number,
    /// Maximum plausible difference between consecutive samples. A larger difference takes effect if
    /// the next sample confirms it.
    #[serde(default)]
    #[schemars(schema_with = "manifest::decimal")]
    jump: Number,
    /// Seconds without a plausible sample after which the sensor is silent (default: never).
    #[serde(default)]
    #[schemars(schema_with = "manifest::decimal")]
    period: Number,
    /// Value of a silent sensor: `worst` (default: the value that satisfies the fewest bounds of designs),
    /// `keep` (the last value), `unknown` (no value, which violates no requirement).
    #[serde(default)]
    stale: Stale,
}

/// Parses the settings of all filters, with defaults for missing keys.
///
/// # Errors
/// The first value that is not a number or out of range, or a `maximum` below the `minimum`.
pub(crate) fn filters(
    confirm_time: &Number,
    heal_time: &Number,
    components: &ComponentsSection,
    measured: &MeasuredsSection,
    origin: &ManifestPath,
) -> Result<FilterSettings, Message> {
    let mut settings = FilterSettings::default();
    if let Some(time) = seconds("confirm_time", confirm_time, origin)? {
        settings.confirm_time = time;
    }
    if let Some(time) = seconds("heal_time", heal_time, origin)? {
        settings.heal_time = time;
    }
    for (name, section) in components {
        let times = ComponentTimes {
            confirm_time: seconds("confirm_time", &section.confirm_time, origin)?,
            heal_time: seconds("heal_time", &section.heal_time, origin)?,
        };
        settings.components.insert(name.clone(), times);
    }
    for (name, section) in measured {
        settings.measured.insert(name.clone(), section.settings(origin)?);
    }
    Ok(settings)
}

impl MeasuredSection {
    fn settings(&self, origin: &ManifestPath) -> Result<MeasuredSettings, Message> {
        let positive =
            |name: &str, value: &Number| value.as_ref().map(|value| origin.number(name, value)).transpose();
        let signed =
            |name: &str, value: &Number| value.as_ref().map(|value| signed(name, value, origin)).transpose();
        let list = |name: &str, values: &[Spanned<toml::Value>]| {
            values.iter().map(|value| self::signed(name, value, origin)).collect::<Result<Vec<_>, _>>()
        };
        let settings = MeasuredSettings {
            hysteresis: positive("hysteresis", &self.hysteresis)?,
            lower_bounds: list("lower_bounds", &self.lower_bounds)?,
            upper_bounds: list("upper_bounds", &self.upper_bounds)?,
            bounds: list("bounds", &self.bounds)?,
            agree: self.agree,
            of: self.of,
            debounce: seconds("debounce", &self.debounce, origin)?.unwrap_or_default(),
            minimum: signed("minimum", &self.minimum)?,
            maximum: signed("maximum", &self.maximum)?,
            jump: positive("jump", &self.jump)?,
            period: seconds("period", &self.period, origin)?,
            stale: self.stale,
        };
        if let (Some(minimum), Some(maximum), Some(place)) =
            (&settings.minimum, &settings.maximum, &self.maximum)
            && minimum > maximum
        {
            return Err(origin.wrong(place.span().start, "`maximum` is less than `minimum`"));
        }
        Ok(settings)
    }
}

fn seconds(name: &str, value: &Number, origin: &ManifestPath) -> Result<Option<Duration>, Message> {
    let Some(value) = value else { return Ok(None) };
    let number = origin.number(name, value)?;
    let wrong = || origin.wrong(value.span().start, format!("`{name}` is too long"));
    Duration::try_from_secs_f64(number::to_f64(&number)).map(Some).map_err(|_| wrong())
}

fn signed(name: &str, value: &Spanned<toml::Value>, origin: &ManifestPath) -> Result<BigRational, Message> {
    let text = match value.get_ref() {
        toml::Value::String(text) => text.clone(),
        other => other.to_string(),
    };
    number::exact(&text).ok_or_else(|| {
        let text = format!("`{name}` is {}, but should be a decimal number", value.get_ref());
        origin.wrong(value.span().start, text)
    })
}
