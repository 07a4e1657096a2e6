//! What follows: SWRL and Datalog rules over interned facts, maintained incrementally.
