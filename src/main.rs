//! The command line of Metaplan.

fn main() {}
