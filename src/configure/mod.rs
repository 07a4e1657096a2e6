//! Design selection without a task plan, the role of MROS: a design for every function in need.
//!
//! [`Configurator`] holds a knowledge base with objectives, chooses the best designs for those in
//! need, with reasons, and grounds them. Utility and exclusion of designs follow MROS \[1\], with
//! two differences. A design that is estimated to miss fewer requirements of the objective comes
//! first (MROS computes this and does not use it). Functions whose designs compete for a component
//! or share a budget are solved jointly, with a proof that no choice is better. [`Keeper`] is the
//! adaptation loop.
//!
//! - \[1\] Bozhinoski et al., MROS: Runtime Adaptation For Robot Control Architectures, Advanced
//!   Robotics 36, 2022.

mod choice;
mod configurator;
mod keeper;
mod record;

pub use choice::{Choice, Configuration, Considered, Verdict, Wishes, Worth};
pub use configurator::{Configurator, Goal};
pub use keeper::{Keeper, KeeperAnswer, Service};
