//! The program `popf`, which PlanSys2's plugin for POPF runs.

use std::io::Write as _;

fn main() {
    let output = metaplan_ros::popf::run(std::env::args().skip(1), |name| std::env::var(name).ok());
    // A closed pipe is not an error.
    let _ = std::io::stdout().write_all(output.out.as_bytes());
    let _ = std::io::stderr().write_all(output.error.as_bytes());
}
