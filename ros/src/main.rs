//! The program `metaplan-ros`.

fn main() {}
