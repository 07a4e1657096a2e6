//! State of a single robot, which turns an event into a decision. It has no network and takes the time from the
//! events. So equal events at equal times lead to equal decisions, except for plans whose search was ended by a time
//! limit.

use std::time::Duration;

use metaplan::mapek::{Answer, Loop, Observation, Snapshot};
use serde_json::Value;

use crate::ids::Ids;
use crate::missions::{Missions, Template};
use crate::store::Stored;
use crate::wire::{Decided, FORMAT, Migration, SafePoint, Saved};

/// State of a robot. Events that are not decided yet are not part of it.
#[derive(Debug, Default)]
pub struct Robot {
    /// Name of the robot's mission; `None` if the robot is not enrolled.
    pub mission: Option<String>,
    /// Checksum of the version of the robot's mission.
    pub digest: String,
    /// Time of enrolment in microseconds since 1970.
    pub enrolled: u64,
    /// Sequence number of the last event that was decided.
    pub event: u64,
    /// Ids of decided events.
    pub ids: Ids,
    /// Requested change to another version of the mission.
    pub migration: Option<Migration>,
    control: Control,
}

#[derive(Debug, Default)]
enum Control {
    #[default]
    None,
    Warm(Box<Loop>),
    /// Unloaded: compressed snapshot of a few kilobytes.
    Cold(Vec<u8>),
}

/// Reason for refusing an event, which then changes nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Refused {
    /// The robot is not enrolled, so it has no mission.
    Unknown,
    /// The event enrols a robot that is already enrolled.
    Enrolled,
    /// The directory of missions has no mission of this name.
    Mission,
    /// The event requests a migration at an unknown point.
    SafePoint,
    /// The message id contains the name of another robot.
    Forged,
    /// The subject's partition is not the partition of the robot.
    Misplaced,
    /// An event with the same message id was decided before.
    Repeated,
    /// The robot was retired while it was suspended, before it handled the event.
    Skipped,
}

impl Refused {
    /// Returns the name of the reason in metrics.
    pub fn name(self) -> &'static str {
        match self {
            Self::Unknown => "not_enrolled",
            Self::Enrolled => "enrolled_already",
            Self::Mission => "unknown_mission",
            Self::SafePoint => "unknown_safe_point",
            Self::Forged => "forged_id",
            Self::Misplaced => "wrong_partition",
            Self::Repeated => "repeated_id",
            Self::Skipped => "retired_meanwhile",
        }
    }

    /// Returns a sentence about the reason for the sender of the event.
    pub fn sentence(self) -> &'static str {
        match self {
            Self::Unknown => {
                "the robot is not enrolled: send `{\"event\": \"enrol\", \"mission\": NAME}` first"
            }
            Self::Enrolled => {
                "the robot is enrolled already: send `{\"event\": \"retire\"}` before it gets another mission"
            }
            Self::Mission => "there is no mission of that name",
            Self::SafePoint => "`at` is `action_end` or `goal`",
            Self::Forged => "the message id must be that of its robot: `ROBOT:NUMBER`",
            Self::Misplaced => "the robot belongs to another partition",
            Self::Repeated => "an event with this message id was decided before",
            Self::Skipped => "the robot was suspended before this event, and retired after it",
        }
    }
}

enum Request<'a> {
    Enrol(&'a str),
    Retire,
    Migrate(Option<SafePoint>),
    Observe,
}

/// Reason why a robot cannot handle events until its mission or data are repaired.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Faulted(pub String);

/// Result of the first phase of a decision.
#[derive(Debug)]
pub enum Begun {
    /// The event is decided.
    Decided(Decided),
    /// The event is refused and has changed nothing.
    Refused(Refused),
    /// A search for a plan is necessary: [`Robot::search`] completes the decision.
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
    /// Restores a robot from its snapshot. If the version of its mission is missing, also returns the
    /// reason; the robot can then only be [retired](Robot::retire_suspended).
    pub fn restore(saved: &Saved, missions: &Missions) -> (Self, Option<Faulted>) {
        let mut robot = Self {
            mission: saved.mission.clone(),
            digest: saved.digest.clone(),
            enrolled: saved.enrolled,
            event: saved.event,
            ids: saved.ids.clone(),
            migration: saved.migration.clone(),
            control: Control::None,
        };
        let Some(name) = &saved.mission else { return (robot, None) };
        robot.control = Control::Cold(compressed(&saved.known));
        let missing = version(missions, name, &saved.digest).err();
        (robot, missing)
    }

    /// Returns a snapshot of the robot. `decision` is the sequence number of its last decision.
    pub fn save(&self, decision: u64) -> Saved {
        let snapshot = match &self.control {
            Control::None => Value::Null,
            Control::Warm(control) => control.snapshot().0,
            Control::Cold(bytes) => decompressed(bytes),
        };
        Saved {
            mission: self.mission.clone(),
            digest: self.digest.clone(),
            enrolled: self.enrolled,
            event: self.event,
            decision,
            known: snapshot,
            migration: self.migration.clone(),
            ids: self.ids.clone(),
            behind: false,
        }
    }

    /// Returns `true` if the loop is loaded in memory.
    pub fn is_warm(&self) -> bool {
        matches!(self.control, Control::Warm(_))
    }

    /// Replaces a loaded loop by its compressed snapshot, to save memory.
    pub fn cool(&mut self) {
        if let Control::Warm(control) = &self.control {
            self.control = Control::Cold(compressed(&control.snapshot().0));
        }
    }

    /// Decides an event: enrols the robot, retires it, changes the version of its mission, or lets its
    /// loop handle the event. During recovery, `before` is the decision about this event that a former
    /// owner has stored: its plans are used, and the new answers must be equal to its answers except
    /// for the wording of explanations. Returns a [`Refused`] if the event is refused; the state of
    /// the loop is then unchanged.
    ///
    /// # Errors
    /// The robot cannot continue: its mission is missing, its snapshot does not fit the mission, or
    /// the answers differ from those of `before`. Its state may be invalid and has to be recovered.
    pub fn decide(
        &mut self,
        event: &Stored,
        missions: &Missions,
        before: Option<&Decided>,
    ) -> Result<Result<Decided, Refused>, Faulted> {
        Ok(match self.begin(event, missions, before)? {
            Begun::Decided(decided) => Ok(decided),
            Begun::Refused(refused) => Err(refused),
            Begun::Search(search) => Ok(self.search(search)?),
        })
    }

    /// Runs the first phase of [`Robot::decide`], which includes everything except searches for
    /// plans. It usually takes milliseconds, while a search can take minutes.
    ///
    /// # Errors
    /// As for [`Robot::decide`].
    pub fn begin(
        &mut self,
        event: &Stored,
        missions: &Missions,
        before: Option<&Decided>,
    ) -> Result<Begun, Faulted> {
        // A former owner may have decided an event that this version refuses.
        if before.is_none() && event.id.as_ref().is_some_and(|id| self.ids.contains(id)) {
            return Ok(Begun::Refused(Refused::Repeated));
        }
        let text = String::from_utf8_lossy(&event.payload);
        let head: Value = serde_json::from_str(&text).unwrap_or_default();
        let mut search = Search { decided: empty(event.sequence), answers: Vec::new(), id: event.id.clone() };
        let is_complete = match request(&head) {
            Request::Enrol(name) => {
                if self.mission.is_some() {
                    return Ok(Begun::Refused(Refused::Enrolled));
                }
                let recorded = before.and_then(|before| before.digest.as_deref());
                let template = match recorded {
                    Some(digest) => version(missions, name, digest)?,
                    None => match missions.get(name) {
                        Some(template) => template,
                        None => return Ok(Begun::Refused(Refused::Mission)),
                    },
                };
                search.decided.enrolled = Some(name.to_owned());
                search.decided.digest = Some(template.digest.clone());
                self.mission = Some(name.to_owned());
                (self.digest, self.enrolled) = (template.digest.clone(), event.time);
                self.control = Control::Warm(Box::new(template.control.clone()));
                self.deliberate(&mut search.answers, before)
            }
            Request::Retire => {
                if self.mission.is_none() {
                    return Ok(Begun::Refused(Refused::Unknown));
                }
                return Ok(Begun::Decided(self.retire(event, before.is_some_and(|before| before.skips))));
            }
            Request::Migrate(safe_point) => {
                let Some(name) = self.mission.clone() else { return Ok(Begun::Refused(Refused::Unknown)) };
                let Some(safe_point) = safe_point else { return Ok(Begun::Refused(Refused::SafePoint)) };
                let target = match before {
                    Some(before) => before.target.clone(),
                    None => match missions.get(&name) {
                        Some(template) => Some(template.digest.clone()).filter(|own| *own != self.digest),
                        None => return Ok(Begun::Refused(Refused::Mission)),
                    },
                };
                search.decided.now = event.time.saturating_sub(self.enrolled);
                self.warm(missions)?;
                search.decided.target.clone_from(&target);
                self.migration = target.map(|target| Migration { at: safe_point, target });
                // If the robot does not change its version now, nothing has to be planned.
                !self.migrate(&name, missions, &mut search, before)?
                    || self.deliberate(&mut search.answers, before)
            }
            Request::Observe => {
                let Some(name) = self.mission.clone() else { return Ok(Begun::Refused(Refused::Unknown)) };
                search.decided.now = event.time.saturating_sub(self.enrolled);
                let now = Duration::from_micros(search.decided.now);
                self.warm(missions)?;
                let Control::Warm(control) = &mut self.control else {
                    return Ok(Begun::Refused(Refused::Unknown));
                };
                search.answers = control.react(&Observation::parse(&text), now);
                self.migrate(&name, missions, &mut search, before)?;
                self.deliberate(&mut search.answers, before)
            }
        };
        if !is_complete && before.is_none() {
            return Ok(Begun::Search(search));
        }
        let decided = self.complete(search);
        if let Some(before) = before
            && !is_same(&decided, before)
        {
            let text =
                format!("the stored decision of event {} differs from the computed one", event.sequence);
            return Err(Faulted(text));
        }
        Ok(Begun::Decided(decided))
    }

    /// Runs the second phase of [`Robot::decide`]: searches for plans.
    ///
    /// # Errors
    /// The loop is not loaded, because [`Robot::begin`] did not precede.
    pub fn search(&mut self, mut search: Search) -> Result<Decided, Faulted> {
        let Control::Warm(control) = &mut self.control else {
            return Err(Faulted("the loop of the robot is not loaded".to_owned()));
        };
        search.answers.extend(control.deliberate());
        Ok(self.complete(search))
    }

    /// Retires a suspended robot, whatever its state. Its events that are not decided are refused.
    pub fn retire_suspended(&mut self, event: &Stored) -> Decided {
        self.retire(event, true)
    }

    fn retire(&mut self, event: &Stored, skips: bool) -> Decided {
        self.ids.extend(event.id.as_deref());
        let ids = std::mem::take(&mut self.ids);
        *self = Self { ids: ids.clone(), event: event.sequence, ..Self::default() };
        Decided { retired: true, skips, ids, ..empty(event.sequence) }
    }

    /// Plans without a search, or replays the plans of `before`. Returns `false` if a search is necessary; the loop
    /// is then unchanged.
    fn deliberate(&mut self, answers: &mut Vec<Answer>, before: Option<&Decided>) -> bool {
        let Control::Warm(control) = &mut self.control else { return true };
        let more = match before {
            Some(before) => Some(control.deliberate_again(&before.plans)),
            None => control.deliberate_at_once(),
        };
        let is_complete = more.is_some();
        answers.extend(more.into_iter().flatten());
        is_complete
    }

    /// Changes to another version of the mission if this was requested, the version is available, and the loop is at
    /// the requested point. A recorded decision determines whether the robot changes. Returns `true` if the robot has
    /// changed; the new loop then has to plan. If the version does not fit, an error becomes an answer, and the
    /// request is dropped.
    fn migrate(
        &mut self,
        name: &str,
        missions: &Missions,
        search: &mut Search,
        before: Option<&Decided>,
    ) -> Result<bool, Faulted> {
        let (Some(migration), Control::Warm(control)) = (&self.migration, &self.control) else {
            return Ok(false);
        };
        let template = if let Some(before) = before {
            let Some(digest) = &before.digest else { return Ok(false) };
            version(missions, name, digest)?
        } else {
            let is_safe = control.is_between_actions()
                && (migration.at == SafePoint::ActionEnd || control.beliefs().reached());
            match missions.version(name, &migration.target) {
                Some(template) if is_safe => template,
                _ => return Ok(false),
            }
        };
        let initial = version(missions, name, &self.digest)?;
        let mut next = template.control.clone();
        search.decided.digest = Some(template.digest.clone());
        self.migration = None;
        match next.migrate(control, &initial.control) {
            Ok(answers) => {
                search.answers.extend(answers);
                search.decided.migrated = true;
                self.digest.clone_from(&template.digest);
                self.control = Control::Warm(Box::new(next));
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
        if let Control::Warm(control) = &mut self.control {
            let decision = control.decision(&answers);
            (decided.answers, decided.plans) = (decision.answers, decision.plans);
        }
        self.event = decided.event;
        self.ids.extend(id.as_deref());
        decided
    }

    fn warm(&mut self, missions: &Missions) -> Result<(), Faulted> {
        let (Control::Cold(bytes), Some(mission)) = (&self.control, &self.mission) else { return Ok(()) };
        let mut control = version(missions, mission, &self.digest)?.control.clone();
        control
            .restore(&Snapshot(decompressed(bytes)))
            .map_err(|message| Faulted(message.text().to_owned()))?;
        self.control = Control::Warm(Box::new(control));
        Ok(())
    }
}

fn version<'a>(missions: &'a Missions, name: &str, digest: &str) -> Result<&'a Template, Faulted> {
    missions.version(name, digest).ok_or_else(|| {
        Faulted(format!(
            "the version {digest} of mission `{name}`, with which it was enrolled, is in no directory of missions: \
             start workers with `--former DIR` for the former files, or retire the robot"
        ))
    })
}

fn empty(event: u64) -> Decided {
    Decided {
        format: FORMAT.to_owned(),
        event,
        now: 0,
        enrolled: None,
        retired: false,
        migrated: false,
        digest: None,
        target: None,
        skips: false,
        ids: Ids::default(),
        answers: Vec::new(),
        plans: Vec::new(),
        worker: String::new(),
        epoch: 0,
    }
}

pub(crate) fn is_retirement(payload: &[u8]) -> bool {
    // Most events do not contain this word, so they need not be parsed.
    let has_word = payload.windows(6).any(|part| part == b"retire");
    has_word && serde_json::from_slice(payload).is_ok_and(|head| matches!(request(&head), Request::Retire))
}

fn request(head: &Value) -> Request<'_> {
    let text = |name: &str| head.get(name).and_then(Value::as_str);
    match text("event") {
        Some("enrol") => Request::Enrol(text("mission").unwrap_or_default()),
        Some("retire") => Request::Retire,
        Some("migrate") => Request::Migrate(match head.get("at") {
            None => Some(SafePoint::default()),
            Some(point) => serde_json::from_value(point.clone()).ok(),
        }),
        _ => Request::Observe,
    }
}

/// Returns `true` if two decisions have equal answers, except for the wording of explanations, and equally enrol,
/// retire or migrate the robot.
fn is_same(left: &Decided, right: &Decided) -> bool {
    left.enrolled == right.enrolled
        && left.retired == right.retired
        && left.migrated == right.migrated
        && left.target == right.target
        && left.decision().agrees(&right.answers)
}

fn compressed(known: &Value) -> Vec<u8> {
    lz4_flex::compress_prepend_size(known.to_string().as_bytes())
}

fn decompressed(bytes: &[u8]) -> Value {
    let text = lz4_flex::decompress_size_prepended(bytes).unwrap_or_default();
    serde_json::from_slice(&text).unwrap_or_default()
}
