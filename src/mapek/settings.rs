//! Settings of the adaptation loop: the section `adaptation` of a manifest.

use std::path::Path;
use std::time::Duration;

use num_rational::BigRational;
use schemars::JsonSchema;
use serde::Deserialize;
use toml::Spanned;

use crate::knowledge::Knowledge;
use crate::manifest::{self, Key, ManifestPath, Part};
use crate::mapek::filter::{ComponentsSection, FilterSettings, MeasuredsSection, filters};
use crate::message::{Errors, Message};
use crate::mission::TimeUnit;
use crate::number;

/// The section `adaptation` of a manifest.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AdaptationSection {
    /// Minimum improvement of the metric for which a valid plan is replaced (default 0: any improvement).
    #[serde(default)]
    #[schemars(schema_with = "manifest::decimal")]
    minimum_benefit: Option<Spanned<toml::Value>>,
    /// Seconds after a design has become available again, or facts have changed, before the loop searches for a
    /// better plan (default 5). Always in seconds, independent of the domain's time unit.
    #[serde(default)]
    #[schemars(schema_with = "manifest::decimal")]
    settle: Option<Spanned<toml::Value>>,
    /// Time limit of a search for a plan in seconds (default 10). At the limit, the best plan found is used. A
    /// search without a proved outcome is repeated after pauses that double up to an hour, with limits that double
    /// up to 8 times this limit.
    #[serde(default)]
    #[schemars(schema_with = "manifest::decimal")]
    time_limit: Option<Spanned<toml::Value>>,
    /// Choose, among equally good plans of equal length, one that keeps most steps of the current plan.
    /// Otherwise the choice depends only on the situation.
    #[serde(default)]
    stay_close: bool,
    /// Seconds without a contrary report after which a reported failure of a component takes effect (default 0: at
    /// once).
    #[serde(default)]
    #[schemars(schema_with = "manifest::decimal")]
    confirm_time: Option<Spanned<toml::Value>>,
    /// Seconds without a report of a failure, counted from the first report that a failed component works, after
    /// which it counts as recovered (default 2).
    #[serde(default)]
    #[schemars(schema_with = "manifest::decimal")]
    heal_time: Option<Spanned<toml::Value>>,
    /// Hysteresis of attributes without their own `hysteresis`, as a share of the bound (default 0.02; 0 for none).
    #[serde(default)]
    #[schemars(schema_with = "manifest::decimal")]
    band: Option<Spanned<toml::Value>>,
    /// Settings of single components, by local name.
    #[serde(default)]
    components: ComponentsSection,
    /// Filters of measured attributes, by local name.
    #[serde(default)]
    measured: MeasuredsSection,
    /// Immediate reaction, before planning, if the current action loses a design or cannot continue.
    /// `reconfigure` (default) selects other available designs if the action can be completed with
    /// them, and suspends it otherwise. `suspend` always suspends it.
    #[serde(default)]
    safe_reaction: SafeReaction,
    /// Seconds without acknowledgement after which an effect is overdue, and minimum time without a
    /// report after which an action is overdue (default 10; 0 for no deadline).
    #[serde(default)]
    #[schemars(schema_with = "manifest::decimal")]
    deadline: Option<Spanned<toml::Value>>,
    /// An action is overdue after this multiple of its expected duration without a report (default 3).
    #[serde(default)]
    #[schemars(schema_with = "manifest::decimal")]
    deadline_factor: Option<Spanned<toml::Value>>,
    /// Reaction if the journal cannot be written, as on a full disk: `stop` (default) ends the program;
    /// `continue` marks the journal as incomplete, so that it cannot be resumed, answers `unrecorded`, and continues
    /// without it.
    #[serde(default)]
    unrecorded: Unrecorded,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct Section {
    #[serde(default)]
    adaptation: AdaptationSection,
}

/// The safe effect that precedes planning.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum SafeReaction {
    /// Request other available designs with which the rest of the action can be executed. Without such designs,
    /// suspend the action.
    #[default]
    Reconfigure,
    /// Suspend the action.
    Suspend,
}

/// Reaction to a journal that cannot be written.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Unrecorded {
    /// The loop stops before the answers that are not recorded leave the program.
    #[default]
    Stop,
    /// The journal is marked as incomplete, and the loop continues without it.
    Continue,
}

impl AdaptationSection {
    /// Returns the settings, with defaults for missing keys.
    ///
    /// # Errors
    /// The first value that is not a number, is negative where it must not be, or is too long for a duration; or a
    /// `maximum` below its `minimum`.
    pub fn settings(&self, origin: &ManifestPath) -> Result<Settings, Message> {
        let filters = filters(&self.confirm_time, &self.heal_time, &self.components, &self.measured, origin)?;
        let (stay_close, safe_reaction, unrecorded) = (self.stay_close, self.safe_reaction, self.unrecorded);
        let mut settings = Settings { stay_close, filters, safe_reaction, unrecorded, ..Settings::default() };
        if let Some(value) = &self.band {
            settings.filters.band = origin.number("band", value)?;
        }
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

/// Settings of the adaptation loop.
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
    /// Minimum benefit of a new plan over a valid current plan, in the metric's unit. With 0, any benefit is
    /// sufficient.
    pub minimum_benefit: BigRational,
    /// Time for which a design must be available again, or that must pass after a change of facts, before a better plan
    /// is sought. Default: 5 s.
    pub settle: Duration,
    /// Time limit of one search for a plan. At the limit, the best plan found is used. A repetition after a search
    /// without a proved outcome has twice the limit of that search, at most 8 times this limit. `None` for no limit.
    /// Default: 10 s.
    pub time_limit: Option<Duration>,
    /// Whether to prefer, among optimal plans of equal length, one that shares most steps with the current plan. The
    /// choice then depends on the history, and not only on the situation. Has no effect if the incremental planner does
    /// not support the mission.
    pub stay_close: bool,
    /// Filters for measurements and component reports.
    pub filters: FilterSettings,
    /// Effect requested before planning if the action under way cannot continue unchanged: other designs or suspension.
    pub safe_reaction: SafeReaction,
    /// Time without acknowledgement after which an effect is overdue, and minimum time without a report after which an
    /// action is overdue. 0 disables deadlines. Default: 10 s.
    pub deadline: Duration,
    /// Multiple of an action's expected duration after which the action is overdue if no report arrives. Default: 3.
    pub deadline_factor: f64,
    /// Unit of the domain's times.
    pub time_unit: TimeUnit,
    /// Reaction to a journal that cannot be written.
    pub unrecorded: Unrecorded,
}

impl Settings {
    /// Settings without damping: every report is believed at once, and a better plan is sought at once.
    pub fn immediate() -> Self {
        Self { settle: Duration::ZERO, filters: FilterSettings::none(), ..Self::default() }
    }

    /// Reads the settings from a file that contains only the section `adaptation`. Names of components and attributes
    /// in the file must occur in `knowledge`.
    ///
    /// # Errors
    /// The file cannot be read or contains errors. Only the errors of one stage are returned: the first syntax error; or
    /// all unknown keys and all values of a wrong type; or the first number that cannot be used; or all unknown names.
    pub fn read(file: &Path, knowledge: Option<&Knowledge>) -> Result<Self, Errors> {
        let (section, origin) = manifest::read::<Section>(file)?;
        let settings = section.adaptation.settings(&origin)?;
        settings.check(knowledge, &origin)?;
        Ok(settings)
    }

    pub(crate) fn check(&self, knowledge: Option<&Knowledge>, origin: &ManifestPath) -> Result<(), Errors> {
        let mistakes = self.filters.mistakes(knowledge).into_iter().map(|(key, name, message)| {
            let path: [Key; 3] = ["adaptation".into(), key.into(), name.as_str().into()];
            let place = origin.place_of(&path, Part::Key);
            Message::at(&message.code, origin.file(), place, message.message.clone())
        });
        Errors::unless_empty(origin.quote(mistakes))
    }

    pub(crate) fn doubts(&self, knowledge: Option<&Knowledge>) -> Vec<Message> {
        let mut doubts = self.filters.doubts(knowledge);
        if self.settle.is_zero() && knowledge.is_some() {
            let text = "each design that becomes available again starts a search for a better plan immediately: \
                        `settle` is 0";
            doubts.push(
                Message::warning("M144", text).with_help("set `settle` in `[adaptation]` to a few seconds"),
            );
        }
        doubts
    }

    /// Sets [`Settings::filters`].
    #[must_use]
    pub fn with_filters(self, filters: FilterSettings) -> Self {
        Self { filters, ..self }
    }

    /// Sets [`Settings::safe_reaction`].
    #[must_use]
    pub fn with_safe_reaction(self, safe_reaction: SafeReaction) -> Self {
        Self { safe_reaction, ..self }
    }

    /// Sets [`Settings::deadline`].
    #[must_use]
    pub fn with_deadline(self, deadline: Duration) -> Self {
        Self { deadline, ..self }
    }

    /// Sets the reaction to a journal that cannot be written.
    #[must_use]
    pub fn with_unrecorded(self, unrecorded: Unrecorded) -> Self {
        Self { unrecorded, ..self }
    }

    /// Sets [`Settings::time_unit`].
    #[must_use]
    pub fn with_time_unit(self, time_unit: TimeUnit) -> Self {
        Self { time_unit, ..self }
    }

    /// Sets [`Settings::minimum_benefit`].
    #[must_use]
    pub fn with_minimum_benefit(self, minimum_benefit: BigRational) -> Self {
        Self { minimum_benefit, ..self }
    }

    /// Sets [`Settings::settle`].
    #[must_use]
    pub fn with_settle(self, settle: Duration) -> Self {
        Self { settle, ..self }
    }

    /// Sets [`Settings::time_limit`]; `None` for no limit.
    #[must_use]
    pub fn with_time_limit(self, time_limit: impl Into<Option<Duration>>) -> Self {
        Self { time_limit: time_limit.into(), ..self }
    }

    /// Sets [`Settings::stay_close`].
    #[must_use]
    pub fn with_stay_close(self, stay_close: bool) -> Self {
        Self { stay_close, ..self }
    }
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            minimum_benefit: BigRational::from_integer(0.into()),
            settle: SETTLE,
            time_limit: Some(TIME_LIMIT),
            stay_close: false,
            filters: FilterSettings::default(),
            safe_reaction: SafeReaction::default(),
            deadline: DEADLINE,
            deadline_factor: 3.0,
            time_unit: TimeUnit::default(),
            unrecorded: Unrecorded::default(),
        }
    }
}

/// Default of [`Settings::settle`]. A driver may fail and be restarted by its supervisor within seconds; without this
/// time, each recovery would start a search at once. The wait is harmless, because a better plan is not urgent.
const SETTLE: Duration = Duration::from_secs(5);

const DEADLINE: Duration = Duration::from_secs(10);

/// Default time limit of one search for a plan. The robot may wait during planning.
const TIME_LIMIT: Duration = Duration::from_secs(10);
