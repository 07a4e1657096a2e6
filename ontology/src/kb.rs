//! The knowledge bases that we wrote, embedded: an import of one of them is found even where no file is.

/// The TOMASys metamodel with the terms that co-adaptation adds, `<http://metacontrol.org/tomasys>`.
pub const TOMASYS: &str = include_str!("../kb/tomasys.ttl");

/// An unmanned ground vehicle that localises itself, `<http://metacontrol.org/metaplan/ugv>`.
pub const UGV: &str = include_str!("../kb/ugv.ttl");

/// An unmanned underwater vehicle that inspects a pipeline, `<http://metacontrol.org/metaplan/uuv>`.
pub const UUV: &str = include_str!("../kb/uuv.ttl");

/// Ontology IRIs and texts of the above.
pub(crate) const EMBEDDED: [(&str, &str); 3] = [
    ("http://metacontrol.org/tomasys", TOMASYS),
    ("http://metacontrol.org/metaplan/ugv", UGV),
    ("http://metacontrol.org/metaplan/uuv", UUV),
];
