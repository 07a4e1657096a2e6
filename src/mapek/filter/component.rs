//! Filter for the reports of one component: a reported failure or recovery is believed only if no report contradicts it
//! for some time.

use ontology::tomasys::change::Status;
use serde_json::{Value, json};

use crate::mapek::filter::attribute::Micros;

#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct ComponentFilter {
    /// Time for which all reports must be failures before a failure is believed.
    pub confirm: Micros,
    /// Time during which no failure may be reported before a recovery is believed.
    pub heal: Micros,
}

#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct ComponentState {
    has_failed: Option<bool>,
    /// Time since which all reports differ from the believed status, and the last reported status; `None` if the last
    /// report agrees.
    change: Option<(Micros, Status)>,
    /// Number of reports held back since the last change of the believed status.
    pub held: u64,
}

impl ComponentFilter {
    pub(crate) fn report(&self, state: &mut ComponentState, now: Micros, status: Status) -> bool {
        let fails = status == Status::Failed;
        if state.has_failed.unwrap_or(false) == fails {
            state.has_failed = Some(fails);
            state.change = None;
            return true;
        }
        let since = state.change.as_ref().map_or(now, |(since, _)| *since);
        state.change = Some((since, status));
        if now >= since.saturating_add(self.time(status)) {
            Self::accept(state, status);
            return true;
        }
        state.held += 1;
        false
    }

    pub(crate) fn due(&self, state: &ComponentState) -> Option<Micros> {
        let (since, status) = state.change.as_ref()?;
        Some(since.saturating_add(self.time(*status)))
    }

    pub(crate) fn elapse(&self, state: &mut ComponentState, now: Micros) -> Option<Status> {
        self.due(state).filter(|due| *due <= now)?;
        let (_, status) = state.change?;
        Self::accept(state, status);
        Some(status)
    }

    fn accept(state: &mut ComponentState, status: Status) {
        *state = ComponentState { has_failed: Some(status == Status::Failed), ..ComponentState::default() };
    }

    fn time(&self, status: Status) -> Micros {
        if status == Status::Failed { self.confirm } else { self.heal }
    }
}

impl ComponentState {
    pub(crate) fn believing(has_failed: Option<bool>) -> Self {
        Self { has_failed, ..Self::default() }
    }

    pub(crate) fn to_record(&self) -> Value {
        json!([self.has_failed, self.change.map(|(since, status)| json!([since, status.word()])), self.held])
    }

    pub(crate) fn from_record(record: &Value) -> Option<Self> {
        let [has_failed, change, held] = record.as_array()?.as_slice() else { return None };
        Some(Self {
            has_failed: if has_failed.is_null() { None } else { Some(has_failed.as_bool()?) },
            change: match change {
                Value::Null => None,
                pair => Some((pair.get(0)?.as_u64()?, Status::from_word(pair.get(1)?.as_str()?)?)),
            },
            held: held.as_u64()?,
        })
    }
}
