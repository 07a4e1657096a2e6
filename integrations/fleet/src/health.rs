//! Health of a worker, for liveness and readiness probes.

use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Time without a new round of the main loop after which a worker counts as hanging. Rounds also
/// end if the servers are unreachable, because every request has a timeout.
const MAX_SILENCE: Duration = Duration::from_secs(300);

/// Health of a worker. The worker updates it; probes read it.
#[derive(Debug, Default)]
pub struct Health(Mutex<State>);

#[derive(Debug, Default)]
struct State {
    /// Start of the last round of the main loop; `None` before the first one.
    round: Option<Instant>,
    /// Time at which the log last acknowledged the worker's status, and the duration for which the log then
    /// counts as reachable.
    contact: Option<(Instant, Duration)>,
    is_draining: bool,
}

impl Health {
    /// Returns `true` unless the main loop hangs. A worker that waits for its servers is alive, because
    /// a restart would not help.
    pub fn is_live(&self) -> bool {
        self.state(|state| state.round.is_none_or(|round| round.elapsed() < MAX_SILENCE))
    }

    /// Returns `Ok` if the worker takes part in the fleet.
    ///
    /// # Errors
    /// The reason why it does not: it waits for servers, has lost them, or is shutting down.
    pub fn is_ready(&self) -> Result<(), &'static str> {
        self.state(|state| match state.contact {
            _ if state.is_draining => Err("the worker is shutting down"),
            None => Err("the worker has not reached the log yet"),
            Some((contact, valid)) if contact.elapsed() > valid => Err("the log is unreachable"),
            Some(_) => Ok(()),
        })
    }

    pub(crate) fn begin_round(&self, is_draining: bool) {
        self.state(|state| (state.round, state.is_draining) = (Some(Instant::now()), is_draining));
    }

    pub(crate) fn reach(&self, valid: Duration) {
        self.state(|state| state.contact = Some((Instant::now(), valid)));
    }

    fn state<T>(&self, read: impl FnOnce(&mut State) -> T) -> T {
        read(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_worker_is_ready_between_contact_and_shutdown() {
        let health = Health::default();
        assert!(health.is_live() && health.is_ready().is_err());
        health.begin_round(false);
        health.reach(Duration::from_secs(60));
        assert!(health.is_live());
        assert_eq!(health.is_ready(), Ok(()));
        health.reach(Duration::ZERO);
        std::thread::sleep(Duration::from_millis(1));
        assert_eq!(health.is_ready(), Err("the log is unreachable"));
        health.reach(Duration::from_secs(60));
        health.begin_round(true);
        assert_eq!(health.is_ready(), Err("the worker is shutting down"));
        assert!(health.is_live());
    }
}
