# Everyday commands; `just` lists them.

# List the recipes.
default:
    @just --list

# All that must pass before a commit: format, lints, tests, documentation.
check: fmt-check clippy test doc

# Format everything.
fmt:
    cargo fmt --all

# Fail where something is not formatted.
fmt-check:
    cargo fmt --all --check

# Lint everything; warnings are errors.
clippy:
    cargo clippy --workspace --all-targets -- -D warnings

# The tests of the default members.
test:
    cargo test

# The tests that take minutes or hours (benches/suites.toml); without a name, list the suites.
long *SUITES:
    python3 benches/reproduce.py {{SUITES}}

# Fetch the public files that tests read (`just data sources benchmarks`: also those of benchmarks).
data *LISTS:
    python3 data/fetch.py {{LISTS}}

# Produce tables of the README and the book again (benches/tables.toml); without a name, list them.
reproduce *TABLES:
    python3 benches/reproduce.py {{TABLES}}

# Measure: the UGV mission end to end, and the rule engine.
bench:
    cargo bench --bench ugv
    cargo bench -p metaplan-rules --bench engine

# Show the book, anew whenever a page changes; needs mdbook.
book:
    mdbook serve docs

# Build the documentation; warnings are errors.
doc:
    RUSTDOCFLAGS="-D warnings" cargo doc --workspace --no-deps
