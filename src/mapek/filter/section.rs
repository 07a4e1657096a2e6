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

/// A number of a manifest that has not been read yet.
type Number = Option<Spanned<toml::Value>>;

/// Sections of components, by name.
pub(crate) type ComponentsSection = BTreeMap<String, ComponentSection>;

/// Sections of attributes, by name.
pub(crate) type MeasuredsSection = BTreeMap<String, MeasuredSection>;

/// The section `adaptation.components.NAME` of a manifest.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ComponentSection {
    /// `confirm_time` of this component.
    #[serde(default)]
    #[schemars(schema_with = "manifest::decimal")]
    confirm_time: Number,
    /// `heal_time` of this component.
    #[serde(default)]
    #[schemars(schema_with = "manifest::decimal")]
    heal_time: Number,
}

/// The section `adaptation.measured.NAME` of a manifest.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MeasuredSection {
    /// A bound that was missed is kept again by this much, in the attribute's unit (2 % of the bound if nothing is said; 0 for none).
    #[serde(default)]
    #[schemars(schema_with = "manifest::decimal")]
    hysteresis: Number,
    /// Values at which designs change, besides the bounds that the designs of the knowledge base state: those in rules.
    #[serde(default)]
    #[schemars(with = "Vec<f64>")]
    bounds: Vec<Spanned<toml::Value>>,
    /// Of the last `of` samples so many must have crossed a bound before that counts.
    #[serde(default)]
    agree: usize,
    /// Number of samples for `agree`.
    #[serde(default)]
    of: usize,
    /// For so many seconds must all samples have crossed a bound before that counts.
    #[serde(default)]
    #[schemars(schema_with = "manifest::decimal")]
    debounce: Number,
    /// The least plausible value; samples below are ignored.
    #[serde(default)]
    #[schemars(with = "Option<f64>")]
    minimum: Number,
    /// The greatest plausible value; samples above are ignored.
    #[serde(default)]
    #[schemars(with = "Option<f64>")]
    maximum: Number,
    /// The greatest plausible difference from one sample to the next; a farther one counts if the next one confirms it.
    #[serde(default)]
    #[schemars(schema_with = "manifest::decimal")]
    jump: Number,
    /// For longer than so many seconds without a plausible sample, and the sensor is silent (never if nothing is said).
    #[serde(default)]
    #[schemars(schema_with = "manifest::decimal")]
    period: Number,
    /// What counts for a silent sensor: `worst` (the value with which the fewest designs can be used), `keep` (the last value), `unknown`
    /// (no value, which violates no requirement).
    #[serde(default)]
    stale: Stale,
}

/// Reads the settings of all filters.
///
/// # Errors
/// The first value that is not a number, or out of range.
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
        let settings = MeasuredSettings {
            hysteresis: positive("hysteresis", &self.hysteresis)?,
            bounds: self
                .bounds
                .iter()
                .map(|bound| self::signed("bounds", bound, origin))
                .collect::<Result<_, _>>()?,
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
