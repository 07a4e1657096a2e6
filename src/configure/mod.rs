//! MROS's role without a task plan: a design for every function in need.
//!
//! [`Configurator`] keeps a knowledge base with objectives, says which designs are best for those in need, with reasons, and grounds
//! them. What an objective's design is worth, and what rules a design out, is as MROS has it \[1\], with two differences: a design that is
//! estimated to miss fewer requirements of the objective comes first (MROS works that out and does not use it), and functions whose
//! designs compete for a component or share a budget are chosen for together, with a proof that no choice is better.
//! [`Keeper`] is the loop of that.
//!
//! - \[1\] Bozhinoski et al., MROS: Runtime Adaptation For Robot Control Architectures, Advanced Robotics 36, 2022.

mod choice;
mod configurator;
mod keeper;

pub use choice::{Choice, Configuration, Considered, Verdict, Wishes, Worth};
pub use configurator::{Configurator, Goal};
pub use keeper::{Keeper, KeeperAnswer, Service};
