//! How eager the loop is: the section `adaptation` of a manifest.

use std::time::Duration;

use num_rational::BigRational;
use schemars::JsonSchema;
use serde::Deserialize;
use toml::Spanned;

use crate::manifest::{self, ManifestPath};
use crate::message::Message;
use crate::mission::TimeUnit;
use crate::number;

/// The section `adaptation` of a manifest.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AdaptationSection {
    /// A plan that could be kept is replaced only by one whose metric is better by this much; 0 is any benefit.
    #[serde(default)]
    #[schemars(schema_with = "manifest::decimal")]
    minimum_benefit: Option<Spanned<toml::Value>>,
    /// For so many seconds must a design be back before a better plan is looked for; of the clock, whatever the unit of the domain's times.
    #[serde(default)]
    #[schemars(schema_with = "manifest::decimal")]
    settle: Option<Spanned<toml::Value>>,
    /// So many seconds may one plan take (10 if nothing is said); then the best so far is used if there is one, and planning goes on when
    /// something changes.
    #[serde(default)]
    #[schemars(schema_with = "manifest::decimal")]
    time_limit: Option<Spanned<toml::Value>>,
    /// Of plans that are as good and as long, one is chosen that has most steps of the plan at hand; otherwise the choice depends on the
    /// situation alone.
    #[serde(default)]
    stay_close: bool,
    /// What is done at once, before any planning, where the action under way loses a design or cannot go on: `reconfigure` gives it other
    /// available designs if what is left of it can be done with them, and suspends it otherwise; `suspend` always suspends it.
    #[serde(default)]
    safe_reaction: SafeReaction,
    /// So many seconds may an effect remain without acknowledgement, and an action without a report, at least, before it is overdue
    /// (10 if nothing is said; 0 for ever).
    #[serde(default)]
    #[schemars(schema_with = "manifest::decimal")]
    deadline: Option<Spanned<toml::Value>>,
    /// An action is overdue when nothing was heard of it for its expected duration times this (3 if nothing is said).
    #[serde(default)]
    #[schemars(schema_with = "manifest::decimal")]
    deadline_factor: Option<Spanned<toml::Value>>,
}

/// The safe effect that precedes planning.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum SafeReaction {
    /// Other available designs if what is left of the action can be done with them; a standstill otherwise.
    #[default]
    Reconfigure,
    /// A standstill.
    Suspend,
}

impl AdaptationSection {
    /// What it says, and what is so unless it says otherwise.
    ///
    /// # Errors
    /// A value that is not a number, or negative.
    pub fn settings(&self, origin: &ManifestPath) -> Result<Settings, Message> {
        let (stay_close, safe_reaction) = (self.stay_close, self.safe_reaction);
        let mut settings = Settings { stay_close, safe_reaction, ..Settings::default() };
        if let Some(value) = &self.minimum_benefit {
            settings.minimum_benefit = origin.number("minimum_benefit", value)?;
        }
        let seconds = |name: &str, value: &Spanned<toml::Value>| {
            let number = origin.number(name, value)?;
            let wrong = || origin.wrong(value.span().start, format!("`{name}` is too long"));
            Duration::try_from_secs_f64(number::to_f64(&number)).map_err(|_| wrong())
        };
        if let Some(value) = &self.settle {
            settings.settle = seconds("settle", value)?;
        }
        if let Some(value) = &self.deadline {
            settings.deadline = seconds("deadline", value)?;
        }
        if let Some(value) = &self.deadline_factor {
            settings.deadline_factor = number::to_f64(&origin.number("deadline_factor", value)?);
        }
        if let Some(value) = &self.time_limit {
            settings.time_limit = Some(seconds("time_limit", value)?);
        }
        Ok(settings)
    }
}

/// How eager the loop is.
///
/// ```
/// use std::time::Duration;
/// use metaplan::mapek::Settings;
///
/// let settings = Settings::default().with_time_limit(Duration::from_secs(2)).with_settle(Duration::from_millis(500));
/// assert!(!settings.stay_close);
/// ```
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Settings {
    /// Another plan replaces one that could be kept only if its metric is better by this much, in the metric's unit.
    pub minimum_benefit: BigRational,
    /// So long must a design be available again before a better plan is looked for.
    pub settle: Duration,
    /// How long one plan may take; the best so far is used then, if there is one. Ten seconds unless said otherwise.
    pub time_limit: Option<Duration>,
    /// Whether, of plans that are as good and as long, one is chosen that has most steps of the plan at hand. The choice then
    /// depends on what has happened, and no longer on the situation alone.
    pub stay_close: bool,
    /// What is done at once where the action under way cannot go on as it is.
    pub safe_reaction: SafeReaction,
    /// How long an effect may remain without acknowledgement, and an action without a report, at least. Ten seconds unless said
    /// otherwise; zero means for ever.
    pub deadline: Duration,
    /// An action is overdue when nothing was heard of it for its expected duration times this.
    pub deadline_factor: f64,
    /// The unit of the domain's times.
    pub time_unit: TimeUnit,
}

impl Settings {
    /// What is done at once where the action under way cannot go on as it is.
    #[must_use]
    pub fn with_safe_reaction(self, safe_reaction: SafeReaction) -> Self {
        Self { safe_reaction, ..self }
    }

    /// How long an effect may remain without acknowledgement, and an action without a report, at least; zero means for ever.
    #[must_use]
    pub fn with_deadline(self, deadline: Duration) -> Self {
        Self { deadline, ..self }
    }

    /// The unit of the domain's times.
    #[must_use]
    pub fn with_time_unit(self, time_unit: TimeUnit) -> Self {
        Self { time_unit, ..self }
    }

    /// Another plan replaces one that could be kept only if its metric is better by this much.
    #[must_use]
    pub fn with_minimum_benefit(self, minimum_benefit: BigRational) -> Self {
        Self { minimum_benefit, ..self }
    }

    /// So long must a design be available again before a better plan is looked for.
    #[must_use]
    pub fn with_settle(self, settle: Duration) -> Self {
        Self { settle, ..self }
    }

    /// How long one plan may take; none for as long as it takes.
    #[must_use]
    pub fn with_time_limit(self, time_limit: impl Into<Option<Duration>>) -> Self {
        Self { time_limit: time_limit.into(), ..self }
    }

    /// Whether, of plans that are as good and as long, one is chosen that has most steps of the plan at hand.
    #[must_use]
    pub fn with_stay_close(self, stay_close: bool) -> Self {
        Self { stay_close, ..self }
    }
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            minimum_benefit: BigRational::from_integer(0.into()),
            settle: Duration::ZERO,
            time_limit: Some(TIME_LIMIT),
            stay_close: false,
            safe_reaction: SafeReaction::default(),
            deadline: DEADLINE,
            deadline_factor: 3.0,
            time_unit: TimeUnit::default(),
        }
    }
}

/// How long an effect may remain without acknowledgement unless said otherwise.
const DEADLINE: Duration = Duration::from_secs(10);

/// How long one plan may take unless said otherwise. A robot waits meanwhile.
const TIME_LIMIT: Duration = Duration::from_secs(10);
