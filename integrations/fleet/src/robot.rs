//! State of a single robot, which turns an event into a decision. It has no network and takes the time from the
//! events. Equal events at equal times therefore lead to equal decisions of [`Robot::decide`], except for plans whose
//! search was ended by a time limit. Decisions of [`Robot::finish`] and [`Robot::plan`] also depend on the plans that
//! their caller provides.

use std::sync::Arc;
use std::time::Duration;

use metaplan::mapek::{Answer, Baseline, Loop, Observation, Thinker, Thoughts};
use serde::{Deserialize, Deserializer};
use serde_json::{Map, Value};

use crate::ids::Membership;
use crate::missions::{Missions, Template};
use crate::store::Stored;
use crate::wire::{Decided, Migration, SafePoint, State};

/// State of a robot. Events that are not decided yet are not part of it.
#[derive(Debug, Default)]
pub struct Robot {
    /// Sequence number of the last event that was decided.
    pub event: u64,
    /// Time between enrolment and the last event that was decided, in microseconds.
    now: u64,
    /// State after the last decision. Its snapshot is used only while the loop is [`Control::Stored`].
    state: State,
    control: Control,
}

#[derive(Debug, Default)]
enum Control {
    #[default]
    None,
    /// The loop, and the initial state of its version of the mission.
    Loaded(Box<Loop>, Arc<Baseline>),
    Stored,
    /// The robot's last decision cannot be parsed.
    Unreadable,
}

/// Reason for refusing an event, which then changes nothing. As text, a sentence for the sender of the event;
/// as a static string, the name of the reason in metrics.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error, strum::IntoStaticStr)]
#[strum(serialize_all = "snake_case")]
pub enum Refused {
    /// The robot is not enrolled, so it has no mission.
    #[error(r#"the robot is not enrolled: send `{{"event": "enrol", "mission": NAME}}` first"#)]
    NotEnrolled,
    /// The event enrols a robot that is already enrolled.
    #[error(r#"the robot is enrolled already: send `{{"event": "retire"}}` before it gets another mission"#)]
    EnrolledAlready,
    /// The directory of missions has no mission of this name.
    #[error("there is no mission of that name")]
    UnknownMission,
    /// The event requests a migration at an unknown point.
    #[error("`at` is `action_end` or `goal`")]
    UnknownSafePoint,
    /// The message id does not begin with the robot's name and a colon.
    #[error("the message id must be that of its robot: `ROBOT:NUMBER`")]
    ForgedId,
    /// The subject's partition is not the partition of the robot.
    #[error("the robot belongs to another partition")]
    WrongPartition,
    /// An event with the same message id was decided before.
    #[error("an event with this message id was decided before")]
    RepeatedId,
    /// The number of the message id lies in a merged range, so a decision about the event is possible, but not recorded; see
    /// [`Membership::Unclear`].
    #[error(
        "the event is too late: so many events with higher numbers were decided before it that whether it was decided, \
         too, is not stored"
    )]
    LateId,
}

/// Events for the fleet; all others are observations for the loop. Fields are checked when the event is decided.
#[derive(Default, Deserialize)]
#[serde(tag = "event", rename_all = "snake_case")]
enum Request {
    Enrol {
        #[serde(default)]
        mission: Value,
    },
    Retire,
    Migrate {
        /// `null` is no safe point, but a missing field is the default.
        #[serde(default, deserialize_with = "present")]
        at: Option<Value>,
    },
    #[default]
    #[serde(other)]
    Observe,
}

fn present<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<Value>, D::Error> {
    Value::deserialize(deserializer).map(Some)
}

impl Request {
    /// Parses an event. Only JSON objects are requests: serde also reads other values as a tagged enum.
    fn parse(text: &str) -> Self {
        let object = serde_json::from_str::<Map<String, Value>>(text);
        object.ok().and_then(|object| Self::deserialize(Value::Object(object)).ok()).unwrap_or_default()
    }
}

/// Reason why an event is not decided.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Undecided {
    /// The event is refused, and has changed nothing.
    #[error(transparent)]
    Refused(#[from] Refused),
    /// The robot cannot handle events until its mission or data are repaired.
    #[error("{0}")]
    Faulted(String),
}

/// Result of the first phase of a decision.
#[derive(Debug)]
pub enum Begun {
    /// The event is decided.
    Decided(Decided),
    /// A search for a plan is necessary: [`Robot::thinker`] finds it, and [`Robot::finish`] completes the decision.
    Search(Search),
}

/// A decision without its plan.
#[derive(Debug)]
pub struct Search {
    decided: Decided,
    answers: Vec<Answer>,
    /// Message id of the event, which is recorded when the decision is complete.
    id: Option<String>,
}

impl Robot {
    /// Restores a robot from its last decision. The loop is loaded with the first event that needs it.
    pub fn restore(last: Decided) -> Self {
        let control = if last.state.mission.is_some() { Control::Stored } else { Control::None };
        Self { event: last.event, now: last.now, state: last.state, control }
    }

    /// Returns a robot whose last decision cannot be parsed. It can only be retired.
    pub fn unreadable() -> Self {
        let state = State { mission: Some(String::new()), ..State::default() };
        Self { state, control: Control::Unreadable, ..Self::default() }
    }

    /// Returns the name of the robot's mission; `None` if the robot is not enrolled.
    pub fn mission(&self) -> Option<&str> {
        self.state.mission.as_deref()
    }

    /// Decides an event: enrols the robot, retires it, changes the version of its mission, or lets its
    /// loop handle the event.
    ///
    /// # Errors
    /// The event is refused, and the state is unchanged. Or the robot cannot continue: its mission is missing, its
    /// snapshot does not fit the mission, or its last decision cannot be parsed.
    pub fn decide(&mut self, event: &Stored, missions: &Missions) -> Result<Decided, Undecided> {
        match self.begin(event, missions)? {
            Begun::Decided(decided) => Ok(decided),
            Begun::Search(search) => {
                let thoughts = self.thinker(missions)?.map(Thinker::think);
                Ok(self.finish(search, thoughts))
            }
        }
    }

    /// Runs the first phase of [`Robot::decide`], which includes everything except searches for
    /// plans. It usually takes milliseconds, while a search can take minutes.
    ///
    /// # Errors
    /// As for [`Robot::decide`].
    pub fn begin(&mut self, event: &Stored, missions: &Missions) -> Result<Begun, Undecided> {
        match event.id.as_ref().map(|id| self.state.ids.membership(id)) {
            Some(Membership::Present) => return Err(Refused::RepeatedId.into()),
            Some(Membership::Unclear) => return Err(Refused::LateId.into()),
            Some(Membership::Absent) | None => {}
        }
        let text = String::from_utf8_lossy(&event.payload);
        let request = Request::parse(&text);
        let decided = Decided { event: event.sequence, ..Decided::default() };
        let mut search = Search { decided, answers: Vec::new(), id: event.id.clone() };
        if let Request::Enrol { mission } = &request {
            if self.state.mission.is_some() {
                return Err(Refused::EnrolledAlready.into());
            }
            let name = mission.as_str().unwrap_or_default();
            let template = missions.get(name).ok_or(Refused::UnknownMission)?;
            search.decided.enrolled = Some(name.to_owned());
            self.state.mission = Some(name.to_owned());
            (self.state.digest, self.state.enrolled) = (template.digest.clone(), event.time);
            self.control =
                Control::Loaded(Box::new(template.control.clone()), Arc::clone(&template.baseline));
            return Ok(self.deliberate(search));
        }
        let name = self.state.mission.clone().ok_or(Refused::NotEnrolled)?;
        search.decided.now = event.time.saturating_sub(self.state.enrolled);
        match request {
            Request::Retire => {
                let state = State { ids: std::mem::take(&mut self.state.ids), ..State::default() };
                *self = Self { state, ..Self::default() };
                search.decided.retired = true;
                return Ok(Begun::Decided(self.complete(search)));
            }
            Request::Migrate { at } => {
                let at = at.map_or(Ok(SafePoint::default()), serde_json::from_value);
                let at = at.map_err(|_| Refused::UnknownSafePoint)?;
                let current = missions.get(&name).ok_or(Refused::UnknownMission)?;
                self.load(missions)?;
                let target = Some(current.digest.clone()).filter(|target| *target != self.state.digest);
                self.state.migration = target.map(|target| Migration { at, target });
                // If the robot does not change its version now, nothing has to be planned.
                if !self.migrate(&name, missions, &mut search)? {
                    return Ok(Begun::Decided(self.complete(search)));
                }
            }
            Request::Observe | Request::Enrol { .. } => {
                let now = Duration::from_micros(search.decided.now);
                search.answers = self.load(missions)?.react(&Observation::parse(&text), now);
                self.migrate(&name, missions, &mut search)?;
            }
        }
        Ok(self.deliberate(search))
    }

    /// Completes a decision with the plans that were found in the meantime. Without usable plans, the decision has only
    /// the reaction, and planning [stays pending](Self::is_pending).
    pub fn finish(&mut self, mut search: Search, thoughts: Option<Thoughts>) -> Decided {
        if let Control::Loaded(control, _) = &mut self.control {
            match thoughts.and_then(|thoughts| control.deliberate_with(thoughts, false)) {
                Some(answers) => search.answers.extend(answers),
                None => search.decided.planning = true,
            }
        }
        self.complete(search)
    }

    /// Returns the decision that completes the last ones with these plans. Returns `None` if the loop is not loaded,
    /// planning is not pending, or the plans cannot be used. Plans for an outdated problem can be used only if
    /// `is_late` is `true`.
    pub fn plan(&mut self, thoughts: Thoughts, is_late: bool) -> Option<Decided> {
        let Control::Loaded(control, _) = &mut self.control else { return None };
        let late = !control.is_answered_by(&thoughts);
        let answers = control.has_agenda().then(|| control.deliberate_with(thoughts, is_late))??;
        let decided = Decided { event: self.event, now: self.now, planned: true, late, ..Decided::default() };
        Some(self.complete(Search { decided, answers, id: None }))
    }

    /// Returns `true` if the last decision lacks a plan, which has to be searched for.
    pub fn is_pending(&self) -> bool {
        match &self.control {
            Control::Loaded(control, _) => control.has_agenda(),
            // A missing field is that of a loop before its start, whose first plan is pending.
            Control::Stored => self.state.snapshot.get("agenda").is_none_or(Value::is_object),
            Control::None | Control::Unreadable => false,
        }
    }

    /// Returns a copy of the loop that searches for the pending plan. Returns `None` if no plan is
    /// [pending](Self::is_pending).
    ///
    /// # Errors
    /// As for [`Robot::decide`].
    pub fn thinker(&mut self, missions: &Missions) -> Result<Option<Thinker>, Undecided> {
        if !self.is_pending() {
            return Ok(None);
        }
        Ok(Some(self.load(missions)?.thinker()))
    }

    /// Returns the [number](Loop::question) of the current planning problem; 0 if the loop is not loaded. A restored
    /// loop counts from 0 again.
    pub fn question(&self) -> u64 {
        if let Control::Loaded(control, _) = &self.control { control.question() } else { 0 }
    }

    fn deliberate(&mut self, mut search: Search) -> Begun {
        if let Control::Loaded(control, _) = &mut self.control {
            let Some(answers) = control.deliberate_at_once() else { return Begun::Search(search) };
            search.answers.extend(answers);
        }
        Begun::Decided(self.complete(search))
    }

    /// Changes to another version of the mission if this was requested, the version is available, and the loop is at
    /// the requested point. Returns `true` if the version has changed; the new loop then has to plan. If the state
    /// does not fit the version, an error becomes an answer, and the request is dropped.
    fn migrate(&mut self, name: &str, missions: &Missions, search: &mut Search) -> Result<bool, Undecided> {
        let (Some(migration), Control::Loaded(control, _)) = (&self.state.migration, &self.control) else {
            return Ok(false);
        };
        let is_safe = control.is_between_actions()
            && (migration.at == SafePoint::ActionEnd || control.beliefs().reached());
        let Some(template) = missions.version(name, &migration.target).filter(|_| is_safe) else {
            return Ok(false);
        };
        let initial = version(missions, name, &self.state.digest)?;
        let mut next = template.control.clone();
        self.state.migration = None;
        match next.migrate(control, &initial.control) {
            Ok(answers) => {
                search.answers.extend(answers);
                search.decided.migrated = true;
                self.state.digest.clone_from(&template.digest);
                self.control = Control::Loaded(Box::new(next), Arc::clone(&template.baseline));
                Ok(true)
            }
            Err(message) => {
                let (code, message) = (message.code.clone(), message.message.clone());
                search.answers.push(Answer::Error { code, message });
                Ok(false)
            }
        }
    }

    fn complete(&mut self, search: Search) -> Decided {
        let Search { mut decided, answers, id } = search;
        (self.event, self.now) = (decided.event, decided.now);
        if let Some(id) = &id {
            self.state.ids.insert(id);
        }
        let mut snapshot = Value::Null;
        if let Control::Loaded(control, baseline) = &mut self.control {
            decided.answers = control.decision(&answers).answers;
            // A request to migrate does not plan, so an earlier plan can still be pending.
            decided.planning |= control.has_agenda();
            snapshot = baseline.difference(control);
        }
        decided.state = State { snapshot, ..self.state.clone() };
        decided
    }

    fn load(&mut self, missions: &Missions) -> Result<&mut Loop, Undecided> {
        if let Control::Stored = self.control {
            let template = version(missions, self.mission().unwrap_or_default(), &self.state.digest)?;
            let mut control = template.control.clone();
            let snapshot = std::mem::take(&mut self.state.snapshot);
            let restored = control.restore(&template.baseline.snapshot(snapshot));
            restored.map_err(|message| Undecided::Faulted(message.text().to_owned()))?;
            self.control = Control::Loaded(Box::new(control), Arc::clone(&template.baseline));
        }
        let Control::Loaded(control, _) = &mut self.control else {
            let why = "the robot's last decision cannot be read: retire the robot".to_owned();
            return Err(Undecided::Faulted(why));
        };
        Ok(control)
    }
}

fn version<'a>(missions: &'a Missions, name: &str, digest: &str) -> Result<&'a Template, Undecided> {
    missions.version(name, digest).ok_or_else(|| {
        Undecided::Faulted(format!(
            "the version {digest} of mission `{name}`, with which it was enrolled, is in no directory of missions: \
             start workers with `--former DIR` for the former files, or retire the robot"
        ))
    })
}

pub(crate) fn is_retirement(payload: &[u8]) -> bool {
    matches!(Request::parse(&String::from_utf8_lossy(payload)), Request::Retire)
}
