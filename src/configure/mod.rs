//! Design selection without a task plan, as in MROS: chooses a design for every function that needs one.
//!
//! [`Configurator`] holds a knowledge base with objectives. It chooses the best designs for objectives in need, gives
//! reasons, and grounds the objectives by the chosen designs. By default, utility and exclusion of designs follow MROS
//! \[1\], with two differences. A design that is estimated to miss fewer requirements of the objective is preferred
//! (MROS computes this number and does not use it). Functions whose designs compete for a component or share a budget
//! are solved jointly, with a proof that no choice is better unless a limit is reached. [`Keeper`] is the adaptation
//! loop: it handles the robot's reports and requests the chosen designs.
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
