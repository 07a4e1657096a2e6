//! Empty crate that selects features of shared dependencies; see its `Cargo.toml`.
