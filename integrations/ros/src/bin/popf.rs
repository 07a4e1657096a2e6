//! The program `popf`, which PlanSys2's plugin for POPF calls.

use std::io::Write as _;

fn main() {
    let said = metaplan_ros::popf::run(std::env::args().skip(1), |name| std::env::var(name).ok());
    // Who has closed the other end does not read on.
    let _ = std::io::stdout().write_all(said.out.as_bytes());
    let _ = std::io::stderr().write_all(said.error.as_bytes());
}
