//! Strips the symbols of the program in release builds.
//!
//! The setting `strip` of the profile has no effect on this package: Cargo ignores it for each package with an
//! override section, here `[profile.release.package.metaplan]`.

/// Passes `--strip-all` to the linker in release builds without debug information, if the target environment is
/// `gnu` or `musl`.
fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    let is =
        |name: &str, values: &[&str]| std::env::var(name).is_ok_and(|value| values.contains(&value.as_str()));
    if is("PROFILE", &["release"]) && is("DEBUG", &["false"]) && is("CARGO_CFG_TARGET_ENV", &["gnu", "musl"])
    {
        println!("cargo::rustc-link-arg-bins=-Wl,--strip-all");
    }
}
