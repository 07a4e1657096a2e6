//! What to do about it: PDDL to a ground task, to CNF, to a plan that is proved optimal.

pub mod pddl;
