//! Atoms and numeric fluents by number, those that the task has besides the files among them.

use smallvec::SmallVec;

/// A predicate or function with objects, both by number.
pub(super) type Key = (u32, SmallVec<[u32; 4]>);

/// `(the phase phase N)`, with N in place of objects: so many events have taken place.
pub(super) const PHASE: u32 = u32::MAX - 1;
/// `(has waited)`: since the last event nothing has been done.
pub(super) const WAITED: u32 = u32::MAX - 2;
/// `(the clock)`, in the time unit of the files.
pub(super) const CLOCK: u32 = u32::MAX - 3;
