//! Examples below the options in `metaplan help COMMAND`. A test runs every line, in the order of
//! the commands.

pub(super) const INIT: &str = "\
Examples:
  metaplan init robot
  metaplan init shelf --from warehouse";

pub(super) const PLAN: &str = "\
Examples:
  metaplan plan missions/ugv.toml
  metaplan plan missions/ugv.toml --fail c_kinect --set robot_at=wp2
  metaplan plan missions/uuv.toml --scenario murky_water --certificate proof
  metaplan plan missions/ugv.toml -o ugv.plan
  metaplan plan encodings/ugv/domain.pddl encodings/ugv/problem.pddl \\
    --kb ontology/kb/ugv.ttl";

pub(super) const LINT: &str = "\
Examples:
  metaplan lint missions/ugv.toml
  metaplan lint encodings/ugv/domain.pddl encodings/ugv/problem.pddl \\
    --kb ontology/kb/ugv.ttl";

pub(super) const REASON: &str = "\
Examples:
  metaplan reason ontology/kb/ugv.ttl --rules coadaptation --fail c_kinect
  metaplan reason ontology/kb/ugv.ttl --rules coadaptation --format json";

pub(super) const CONVERT: &str = "\
Examples:
  metaplan convert ontology/kb/ugv.ttl --to functional -o ugv.ofn";

pub(super) const COMPARE: &str = "\
Examples:
  metaplan compare missions/camara_like.toml --battery-unit 1000 \\
    --report compared.html";

pub(super) const CONFIGURE: &str = "\
Examples:
  metaplan configure ontology/kb/ugv.ttl --rules coadaptation --fail c_kinect";

pub(super) const EXPLAIN: &str = "\
Examples:
  metaplan explain missions/ugv.toml
  metaplan explain missions/ugv.toml fd_amcl_kinect --fail c_kinect
  metaplan explain M118";

pub(super) const EXPORT: &str = "\
Examples:
  metaplan export missions/ugv.toml --to pddl --fail c_kinect -o without-kinect";

pub(super) const REPORT: &str = "\
Examples:
  metaplan report missions/ugv.toml -o ugv.html
  metaplan report missions/ugv.toml --scenario kinect_failure \\
    -o failure.html --svg pictures";

pub(super) const RUN: &str = "\
Examples:
  metaplan run missions/ugv.toml
  metaplan run missions/ugv.toml --journal journal --mcap run.mcap
  metaplan run missions/ugv.toml --serve";

pub(super) const JOURNAL: &str = "\
Examples:
  metaplan journal check journal
  metaplan journal show journal";

pub(super) const SIMULATE: &str = "\
Examples:
  metaplan simulate missions/ugv.toml --scenario kinect_comes_and_goes --runs 3";

pub(super) const SWEEP: &str = "\
Examples:
  metaplan sweep missions/studies/kinect.toml --output results
  metaplan sweep missions/studies/kinect.toml --output results --resume
  metaplan sweep missions/studies/kinect.toml --output results \\
    --merge --csv results.csv";

pub(super) const VALIDATE: &str = "\
Examples:
  metaplan validate missions/ugv.toml ugv.plan";

pub(super) const VERIFY: &str = "\
Examples:
  metaplan verify proof
  metaplan verify proof --mission missions/uuv.toml --scenario murky_water";
