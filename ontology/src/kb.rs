//! The embedded knowledge bases of this project. They can be imported without a file.

/// The TOMASys metamodel with the additional terms for co-adaptation, `<http://metacontrol.org/tomasys>`.
pub const TOMASYS: &str = include_str!("../kb/tomasys.ttl");

/// An unmanned ground vehicle with several ways to localise itself, `<http://metacontrol.org/metaplan/ugv>`.
pub const UGV: &str = include_str!("../kb/ugv.ttl");

/// An unmanned underwater vehicle that inspects a pipeline, `<http://metacontrol.org/metaplan/uuv>`.
pub const UUV: &str = include_str!("../kb/uuv.ttl");

pub(crate) const EMBEDDED: [(&str, &str); 3] = [
    ("http://metacontrol.org/tomasys", TOMASYS),
    ("http://metacontrol.org/metaplan/ugv", UGV),
    ("http://metacontrol.org/metaplan/uuv", UUV),
];
