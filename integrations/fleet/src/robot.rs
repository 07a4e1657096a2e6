//! State of a single robot, which turns an event into a decision. It has no network and takes the
//! time from the events. So equal events at equal times lead to equal decisions, except for plans
//! that a time limit has cut short.

use std::time::Duration;

use metaplan::mapek::{Loop, Observation, Snapshot};
use serde_json::Value;

use crate::missions::Missions;
use crate::store::Stored;
use crate::wire::{Decided, FORMAT, Saved};

/// State of a robot. Events that are not decided yet are not part of it.
#[derive(Debug, Default)]
pub struct Robot {
    /// Name of the robot's mission; `None` if the robot is not enrolled.
    pub mission: Option<String>,
    /// Time of enrolment in microseconds since 1970.
    pub enrolled: u64,
    /// Sequence number of the last event that was decided.
    pub event: u64,
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
    /// The message id contains the name of another robot.
    Forged,
    /// The subject's partition is not the partition of the robot.
    Misplaced,
}

impl Refused {
    /// Returns the name of the reason in metrics.
    pub fn name(self) -> &'static str {
        match self {
            Self::Unknown => "not_enrolled",
            Self::Enrolled => "enrolled_already",
            Self::Mission => "unknown_mission",
            Self::Forged => "forged_id",
            Self::Misplaced => "wrong_partition",
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
            Self::Forged => "the message id must be that of its robot: `ROBOT:NUMBER`",
            Self::Misplaced => "the robot belongs to another partition",
        }
    }
}

enum Request<'a> {
    Enrol(&'a str),
    Retire,
    Observe,
}

/// Reason why a robot cannot handle events until its mission or data are repaired.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Faulted(pub String);

impl Robot {
    /// Restores a robot from its snapshot.
    ///
    /// # Errors
    /// The mission does not exist, or has changed since the snapshot.
    pub fn restore(saved: &Saved, missions: &Missions) -> Result<Self, Faulted> {
        let mut robot = Self {
            mission: saved.mission.clone(),
            enrolled: saved.enrolled,
            event: saved.event,
            control: Control::None,
        };
        if let Some(name) = &saved.mission {
            let saved_loop = missions
                .get(name)
                .ok_or_else(|| Faulted(format!("there is no mission `{name}` in the directory")))?;
            if saved_loop.digest != saved.digest {
                let text = format!(
                    "the files or settings of mission `{name}` are not those that it was enrolled with"
                );
                return Err(Faulted(text));
            }
            robot.control = Control::Cold(compressed(&saved.known));
        }
        Ok(robot)
    }

    /// Returns a snapshot of the robot. `decision` is the sequence number of its last decision.
    pub fn save(&self, missions: &Missions, decision: u64) -> Saved {
        let snapshot = match &self.control {
            Control::None => Value::Null,
            Control::Warm(control) => control.snapshot().0,
            Control::Cold(bytes) => decompressed(bytes),
        };
        let template = self.mission.as_deref().and_then(|name| missions.get(name));
        Saved {
            mission: self.mission.clone(),
            digest: template.map(|template| template.digest.clone()).unwrap_or_default(),
            enrolled: self.enrolled,
            event: self.event,
            decision,
            known: snapshot,
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

    /// Decides an event: enrols the robot, retires it, or lets its loop handle the event. During
    /// recovery, `before` is the decision about this event that a former owner has stored: its plans
    /// are used, and the new answers must be equal to its answers except for the wording of
    /// explanations. Returns a [`Refused`] if the event is refused; the state of the loop is then
    /// unchanged.
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
        let text = String::from_utf8_lossy(&event.payload);
        let head: Value = serde_json::from_str(&text).unwrap_or_default();
        let mut decided = Decided {
            format: FORMAT.to_owned(),
            event: event.sequence,
            now: 0,
            enrolled: None,
            retired: false,
            answers: Vec::new(),
            plans: Vec::new(),
            worker: String::new(),
            epoch: 0,
        };
        match request(&head) {
            Request::Enrol(name) => {
                if self.mission.is_some() {
                    return Ok(Err(Refused::Enrolled));
                }
                let Some(template) = missions.get(name) else { return Ok(Err(Refused::Mission)) };
                let mut control = template.control.clone();
                let answers = match before {
                    Some(before) => control.deliberate_again(&before.plans),
                    None => control.start(),
                };
                let decision = control.decision(&answers);
                (decided.answers, decided.plans) = (decision.answers, decision.plans);
                decided.enrolled = Some(name.to_owned());
                (self.mission, self.enrolled) = (Some(name.to_owned()), event.time);
                self.control = Control::Warm(Box::new(control));
            }
            Request::Retire => {
                if self.mission.take().is_none() {
                    return Ok(Err(Refused::Unknown));
                }
                self.control = Control::None;
                decided.retired = true;
            }
            Request::Observe => {
                let Some(name) = &self.mission else { return Ok(Err(Refused::Unknown)) };
                decided.now = event.time.saturating_sub(self.enrolled);
                let now = Duration::from_micros(decided.now);
                self.warm(&name.clone(), missions)?;
                let Control::Warm(control) = &mut self.control else { return Ok(Err(Refused::Unknown)) };
                let observation = Observation::parse(&text);
                let answers = match before {
                    Some(before) => control.handle_again(&observation, now, &before.plans),
                    None => control.handle(&observation, now),
                };
                let decision = control.decision(&answers);
                (decided.answers, decided.plans) = (decision.answers, decision.plans);
            }
        }
        self.event = event.sequence;
        if let Some(before) = before
            && !is_same(&decided, before)
        {
            let text = format!("what is written of event {} is not what follows from it", event.sequence);
            return Err(Faulted(text));
        }
        Ok(Ok(decided))
    }

    fn warm(&mut self, mission: &str, missions: &Missions) -> Result<(), Faulted> {
        let Control::Cold(bytes) = &self.control else { return Ok(()) };
        let template = missions
            .get(mission)
            .ok_or_else(|| Faulted(format!("there is no mission `{mission}` in the directory")))?;
        let mut control = template.control.clone();
        control
            .restore(&Snapshot(decompressed(bytes)))
            .map_err(|message| Faulted(message.text().to_owned()))?;
        self.control = Control::Warm(Box::new(control));
        Ok(())
    }
}

fn request(head: &Value) -> Request<'_> {
    let text = |name: &str| head.get(name).and_then(Value::as_str);
    match text("event") {
        Some("enrol") => Request::Enrol(text("mission").unwrap_or_default()),
        Some("retire") => Request::Retire,
        _ => Request::Observe,
    }
}

/// Returns `true` if two decisions are equal except for the wording of explanations.
fn is_same(left: &Decided, right: &Decided) -> bool {
    left.enrolled == right.enrolled && left.retired == right.retired && left.decision().agrees(&right.answers)
}

fn compressed(known: &Value) -> Vec<u8> {
    lz4_flex::compress_prepend_size(known.to_string().as_bytes())
}

fn decompressed(bytes: &[u8]) -> Value {
    let text = lz4_flex::decompress_size_prepended(bytes).unwrap_or_default();
    serde_json::from_slice(&text).unwrap_or_default()
}
