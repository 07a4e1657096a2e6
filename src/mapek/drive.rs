//! Interfaces between a loop and its environment: observer, effector and clock.

use std::io;
use std::time::{Duration, Instant};

use crate::mapek::answer::Answer;
use crate::mapek::control::Loop;
use crate::mapek::event::Observation;

/// Source of observations.
pub trait Observer {
    /// Waits for the next observation. `None` ends the loop.
    ///
    /// # Errors
    /// The source cannot be read.
    fn observe(&mut self) -> io::Result<Option<Observation>>;
}

/// Recipient of answers, which executes the effects among them.
pub trait Effector {
    /// Receives the answers to the start of the loop, or to one observation, in order. Executes the effects among them.
    ///
    /// # Errors
    /// The effects cannot be executed.
    fn effect(&mut self, answers: &[Answer]) -> io::Result<()>;
}

/// Source of time.
pub trait Clock {
    /// Time since the start of the mission; monotonic.
    fn now(&mut self) -> Duration;
}

/// Clock that returns the time since its creation, from the monotonic system clock.
#[derive(Debug, Clone, Copy)]
pub struct SystemClock(Instant);

impl Default for SystemClock {
    fn default() -> Self {
        Self(Instant::now())
    }
}

impl SystemClock {
    /// Returns the time from the creation of the clock to a moment; 0 for an earlier moment.
    pub fn at(&self, moment: Instant) -> Duration {
        moment.saturating_duration_since(self.0)
    }
}

impl Clock for SystemClock {
    fn now(&mut self) -> Duration {
        self.0.elapsed()
    }
}

/// Starts a loop and runs it until the observer returns `None`: passes each observation to the loop, and its answers to
/// the effector. Sets no timers, so filters and deadlines take effect at the next observation.
///
/// # Errors
/// Errors of the observer and of the effector.
pub fn drive(
    control: &mut Loop,
    observer: &mut dyn Observer,
    effector: &mut dyn Effector,
    clock: &mut dyn Clock,
) -> io::Result<()> {
    effector.effect(&control.start())?;
    while let Some(observation) = observer.observe()? {
        let answers = control.handle(&observation, clock.now());
        effector.effect(&answers)?;
    }
    Ok(())
}
