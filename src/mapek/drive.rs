//! A loop joined with the world: who reports, who acts, and what time it is.

use std::io;
use std::time::{Duration, Instant};

use crate::mapek::answer::Answer;
use crate::mapek::control::Loop;
use crate::mapek::event::Observation;

/// What reports to the loop.
pub trait Observer {
    /// Waits for the next observation; none where there will be no more.
    ///
    /// # Errors
    /// Nothing can be read any more.
    fn observe(&mut self) -> io::Result<Option<Observation>>;
}

/// What does as the loop says.
pub trait Effector {
    /// Takes the answers to one observation, in their order. Effects among them are to be carried out.
    ///
    /// # Errors
    /// Nothing can be done any more.
    fn effect(&mut self, answers: &[Answer]) -> io::Result<()>;
}

/// What time it is.
pub trait Clock {
    /// The time since the start of the mission; it never goes back.
    fn now(&mut self) -> Duration;
}

/// The time since it was made.
#[derive(Debug, Clone, Copy)]
pub struct SystemClock(Instant);

impl Default for SystemClock {
    fn default() -> Self {
        Self(Instant::now())
    }
}

impl Clock for SystemClock {
    fn now(&mut self) -> Duration {
        self.0.elapsed()
    }
}

/// Runs a loop until the observer has no more to say.
///
/// # Errors
/// Those of the observer and of the effector.
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
