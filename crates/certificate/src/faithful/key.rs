//! Numeric identifiers of ground atoms and fluents, including the ones that the task adds to the
//! files.

use smallvec::SmallVec;

/// A predicate or function symbol and its arguments, as numbers.
pub(super) type Key = (u32, SmallVec<[u32; 4]>);

/// `(the phase phase N)`, with the number N as its argument: the number of past events.
pub(super) const PHASE: u32 = u32::MAX - 1;
/// `(has waited)`: no action has ended since the last event.
pub(super) const WAITED: u32 = u32::MAX - 2;
/// `(the clock)`, in the time unit of the files.
pub(super) const CLOCK: u32 = u32::MAX - 3;
