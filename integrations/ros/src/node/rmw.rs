//! Mapping of ROS services to DDS topics, which depends on the middleware of the other
//! participants.
//!
//! `rmw_fastrtps` and Connext relate a reply to its request outside of the data (OMG DDS-RPC 1.0,
//! section 7.8.2, "enhanced"). `rmw_cyclonedds` writes a header before the data. With the wrong
//! mapping, a client discovers a service but never receives a reply.

use std::fmt;

use clap::ValueEnum;
use ros2_client::dds::ServiceMapping;

/// The middleware that the other participants have.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, ValueEnum)]
pub enum Rmw {
    /// Determine it from the vendors of the discovered participants.
    #[default]
    Auto,
    /// `rmw_fastrtps_cpp`, the default of ROS 2.
    Fastrtps,
    /// `rmw_cyclonedds_cpp`.
    Cyclonedds,
}

/// Mapping of ROS services to DDS topics, displayed as the name of a middleware that uses it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Mapping {
    Enhanced,
    Cyclone,
}

impl Mapping {
    pub(crate) fn service_mapping(self) -> ServiceMapping {
        match self {
            Self::Enhanced => ServiceMapping::Enhanced,
            Self::Cyclone => ServiceMapping::Cyclone,
        }
    }

    /// Value of the option `--rmw` that selects the other one of the two mappings.
    pub(crate) fn other(self) -> &'static str {
        match self {
            Self::Enhanced => "cyclonedds",
            Self::Cyclone => "fastrtps",
        }
    }
}

impl fmt::Display for Mapping {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Enhanced => "rmw_fastrtps",
            Self::Cyclone => "rmw_cyclonedds",
        })
    }
}

impl Rmw {
    /// Returns the mapping that the user has selected, or `None` if the vendors of discovered
    /// participants determine it.
    pub(crate) fn fixed(self) -> Option<Mapping> {
        match self {
            Self::Auto => None,
            Self::Fastrtps => Some(Mapping::Enhanced),
            Self::Cyclonedds => Some(Mapping::Cyclone),
        }
    }
}

/// Vendor of a DDS participant (RTPS 2.5, section 8.3.3.1.3; the OMG assigns the ids).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Vendor {
    FastDds,
    Connext,
    Cyclone,
    /// `RustDDS`, the DDS library of this program, which supports both mappings.
    Own,
    Other,
}

impl Vendor {
    pub(crate) fn new(id: [u8; 2]) -> Self {
        match id {
            [1, 0x0F] => Self::FastDds,
            [1, 0x01] => Self::Connext,
            [1, 0x10] => Self::Cyclone,
            [1, 0x12] => Self::Own,
            _ => Self::Other,
        }
    }

    /// Returns the mapping that the vendor uses, or `None` if the vendor is unknown or supports
    /// both.
    pub(crate) fn mapping(self) -> Option<Mapping> {
        match self {
            Self::FastDds | Self::Connext => Some(Mapping::Enhanced),
            Self::Cyclone => Some(Mapping::Cyclone),
            Self::Own | Self::Other => None,
        }
    }
}
