//! Clock of a node: time of the system, or simulated time on `/clock` with the parameter `use_sim_time` (ROS
//! 2 design article "Clock and Time").

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use metaplan::message::Message;

use crate::interfaces::builtin_interfaces::msg::Time;
use crate::interfaces::rosgraph_msgs::msg::Clock as ClockMessage;
use crate::node::{Node, Severity, qos};

/// Time from the first subscription to `/clock` until a warning is logged if no message has arrived.
const CLOCK_WAIT: Duration = Duration::from_secs(5);

#[derive(Debug)]
pub(crate) struct Clock {
    state: Mutex<ClockState>,
}

#[derive(Debug)]
struct ClockState {
    /// Time since the creation of the clock. It never decreases.
    elapsed: Duration,
    /// Instant up to which system time has been added to `elapsed`.
    counted: Instant,
    is_simulated: bool,
    /// Last message on `/clock`, as time since the epoch of the simulation.
    simulated: Option<Duration>,
    is_subscribed: bool,
}

impl Clock {
    pub(crate) fn new() -> Arc<Self> {
        let state = ClockState {
            elapsed: Duration::ZERO,
            counted: Instant::now(),
            is_simulated: false,
            simulated: None,
            is_subscribed: false,
        };
        Arc::new(Self { state: Mutex::new(state) })
    }

    fn state(&self) -> MutexGuard<'_, ClockState> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns the time since the creation of the clock. Simulated time stands still while the simulation is
    /// paused, and does not go back when the simulation is started again.
    pub(crate) fn elapsed(&self) -> Duration {
        let mut state = self.state();
        state.count();
        state.elapsed
    }

    /// Returns the current time for the header of a message. Simulated time is 0 before the first message on `/clock`.
    pub(crate) fn stamp(&self) -> Time {
        let state = self.state();
        let since_epoch = if state.is_simulated {
            state.simulated.unwrap_or_default()
        } else {
            std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap_or_default()
        };
        Time {
            sec: i32::try_from(since_epoch.as_secs()).unwrap_or(i32::MAX),
            nanosec: since_epoch.subsec_nanos(),
        }
    }

    fn simulate(&self, time: Duration) {
        let mut state = self.state();
        if state.is_simulated {
            // A new simulation starts at an earlier time, so its first message adds nothing.
            let step = state.simulated.map_or(Duration::ZERO, |last| time.saturating_sub(last));
            state.elapsed += step;
        }
        state.simulated = Some(time);
    }

    fn mark_subscribed(&self) -> bool {
        std::mem::replace(&mut self.state().is_subscribed, true)
    }

    fn select(&self, is_simulated: bool) {
        let mut state = self.state();
        state.count();
        state.counted = Instant::now();
        state.is_simulated = is_simulated;
    }
}

impl ClockState {
    fn count(&mut self) {
        if !self.is_simulated {
            let now = Instant::now();
            self.elapsed += now.saturating_duration_since(self.counted);
            self.counted = now;
        }
    }
}

impl Node {
    pub(crate) fn clock(&self) -> Arc<Clock> {
        Arc::clone(&self.clock)
    }

    pub(crate) fn use_simulated_time(self: &Arc<Self>, is_simulated: bool) -> Result<(), Message> {
        self.clock.select(is_simulated);
        if !is_simulated || self.clock.mark_subscribed() {
            return Ok(());
        }
        let clock = Arc::clone(&self.clock);
        self.subscribe::<ClockMessage>("/clock", qos::sensor_data(), move |message| {
            let Time { sec, nanosec } = message.clock;
            clock.simulate(Duration::new(u64::try_from(sec).unwrap_or_default(), nanosec));
        })?;
        let weak = Arc::downgrade(self);
        self.spawn(async move {
            smol::Timer::after(CLOCK_WAIT).await;
            let Some(node) = weak.upgrade() else { return };
            let is_missing = {
                let state = node.clock.state();
                state.is_simulated && state.simulated.is_none()
            };
            if is_missing {
                let text =
                    "use_sim_time is true, but no message has arrived on /clock: time does not advance";
                node.log(Severity::Warn, text);
            }
        });
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::Clock;
    use crate::interfaces::builtin_interfaces::msg::Time;

    #[test]
    fn simulated_time_is_that_of_the_messages_and_never_goes_back() {
        let clock = Clock::new();
        clock.select(true);
        let start = clock.elapsed();
        let seconds = Duration::from_secs;
        clock.simulate(seconds(100));
        std::thread::sleep(Duration::from_millis(20));
        assert_eq!(clock.elapsed(), start, "the first message is the beginning");
        clock.simulate(seconds(107));
        assert_eq!(clock.elapsed(), start + seconds(7));
        assert_eq!(clock.stamp(), Time { sec: 107, nanosec: 0 });
        // The simulation is started again.
        clock.simulate(seconds(1));
        assert_eq!(clock.elapsed(), start + seconds(7));
        clock.simulate(seconds(3));
        assert_eq!(clock.elapsed(), start + seconds(9));
        clock.select(false);
        std::thread::sleep(Duration::from_millis(20));
        assert!(clock.elapsed() > start + seconds(9), "time of the system");
        assert!(clock.elapsed() < start + seconds(10));
    }
}
