//! Numeric identifiers of ground atoms and fluents of the PDDL files, and of additional ones that
//! occur only in the task.

use smallvec::SmallVec;

/// A ground atom or fluent: predicate or function symbol, and arguments, all as numbers.
pub(super) type Key = (u32, SmallVec<[u32; 4]>);

/// Symbol of the predicate `the phase`. The atom `(the phase phase N)` is true while exactly N events (groups
/// of timed initial literals of equal time) are past. In a [`Key`], its argument is the number N instead of an
/// object.
pub(super) const PHASE: u32 = u32::MAX - 1;
/// Symbol of the atom `(has waited)`, which a wait until an event makes true and every action makes
/// false.
pub(super) const WAITED: u32 = u32::MAX - 2;
/// Symbol of the fluent `(the clock)`, in the time unit of the PDDL files.
pub(super) const CLOCK: u32 = u32::MAX - 3;
