//! Strips the symbols of the program in release builds.
//!
//! Cargo ignores `strip` of a profile for a package that has overrides of this profile, as this one has.

/// Passes the option to the linker, except in builds with debug information and on platforms with other linkers.
fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    let is =
        |name: &str, values: &[&str]| std::env::var(name).is_ok_and(|value| values.contains(&value.as_str()));
    if is("PROFILE", &["release"]) && is("DEBUG", &["false"]) && is("CARGO_CFG_TARGET_ENV", &["gnu", "musl"])
    {
        println!("cargo::rustc-link-arg-bins=-Wl,--strip-all");
    }
}
